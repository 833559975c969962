#include "assets/json_tree.hpp"

#include "assets/json_reader.hpp"
#include "error.hpp"

#include <simdjson.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace paradize::assets {

namespace {

namespace dom = simdjson::dom;

static_assert(sizeof(JsonNode) == 24 && max_json_bytes <= JsonNode::most_bytes);

constexpr std::size_t max_depth = 256;
constexpr std::size_t few_members = 16; // up to this number members are searched one after another

/// Searches members one after another. Most keys differ in their length, so that few are compared.
const JsonNode *find_member(std::span<const JsonNode> members, std::string_view key) {
    const auto found = std::ranges::find_if(members, [&](const JsonNode &member) {
        return member.key_bytes == key.size() && member.key() == key;
    });
    return found == members.end() ? nullptr : &*found;
}

/// Sorts many members. Returns the key that two of them have.
std::optional<std::string_view> sort_members(std::span<JsonNode> members) {
    if (members.size() > few_members) {
        std::ranges::sort(members, {}, &JsonNode::key);
        const auto twice = std::ranges::adjacent_find(members, {}, &JsonNode::key);
        return twice == members.end() ? std::nullopt : std::optional(twice->key());
    }
    for (std::size_t i = 1; i < members.size(); ++i) {
        if (find_member(members.first(i), members[i].key()) != nullptr) {
            return members[i].key();
        }
    }
    return std::nullopt;
}

/// No document has more nodes, so that their array never moves. Counted in bytes, of which compilers take
/// many at once.
std::size_t most_nodes(std::string_view text) {
    constexpr std::size_t block = 240; // at most 255
    std::size_t sum = 0;
    for (; !text.empty(); text.remove_prefix(std::min(block, text.size()))) {
        unsigned char count = 0;
        for (const char c : text.substr(0, block)) {
            count = static_cast<unsigned char>(count + (c == ',') + (c == '[') + (c == '{'));
        }
        sum += count;
    }
    return sum;
}

/// Copies a parsed document into the nodes of a tree.
class Copier {
  public:
    Copier(std::vector<JsonNode> &nodes, const std::string &file) : nodes_(nodes), file_(file) {}

    JsonNode node(dom::element element) {
        JsonNode out;
        switch (element.type()) {
        case dom::element_type::ARRAY:
            return container(JsonKind::array, dom::array(element),
                             [&](dom::element entry) { return node(entry); });
        case dom::element_type::OBJECT:
            return container(JsonKind::object, dom::object(element), [&](const dom::key_value_pair &member) {
                JsonNode child = node(member.value);
                child.set_key(member.key);
                return child;
            });
        case dom::element_type::STRING:
            out.kind = JsonKind::string;
            out.set_text(std::string_view(element));
            return out;
        case dom::element_type::BOOL:
            out.kind = JsonKind::boolean;
            out.truth = bool(element);
            return out;
        case dom::element_type::NULL_VALUE:
            return out;
        default: // a double, or an integer of 64 bits
            out.kind = JsonKind::number;
            out.number = double(element);
            return out;
        }
    }

  private:
    JsonNode container(JsonKind kind, const auto &entries, const auto &node_of) {
        const std::size_t start = open_.size();
        for (auto entry : entries) {
            open_.push_back(node_of(entry));
        }
        const auto first = open_.begin() + static_cast<std::ptrdiff_t>(start);
        if (kind == JsonKind::object) {
            if (const std::optional<std::string_view> twice = sort_members({first, open_.end()})) {
                throw Error(file_ + ": key \"" + std::string(*twice) + "\" appears twice in one object");
            }
        }
        JsonNode out;
        out.kind = kind;
        out.children = {static_cast<std::uint32_t>(nodes_.size()),
                        static_cast<std::uint32_t>(open_.size() - start)};
        nodes_.insert(nodes_.end(), first, open_.end());
        open_.erase(first, open_.end());
        return out;
    }

    std::vector<JsonNode> &nodes_;
    const std::string &file_;
    std::vector<JsonNode> open_; // the children so far of the containers that are not closed
};

} // namespace

struct JsonTree::Strings {
    dom::parser parser{max_json_bytes};
};

const char *name_of(JsonKind kind) {
    constexpr std::array<const char *, 6> names{"null", "boolean", "number", "string", "array", "object"};
    return names[static_cast<std::size_t>(kind)];
}

JsonTree::JsonTree(std::string_view text, const std::string &file)
    : file_(file), strings_(std::make_unique<Strings>()) {
    dom::element root;
    simdjson::error_code error = strings_->parser.allocate(text.size(), max_depth);
    if (error == simdjson::SUCCESS) {
        error = strings_->parser.parse(text.data(), text.size()).get(root);
    }
    if (error != simdjson::SUCCESS) {
        throw Error(file + ": is not valid JSON: " + simdjson::error_message(error));
    }
    nodes_.reserve(most_nodes(text));
    root_ = Copier(nodes_, file_).node(root);
}

JsonTree::~JsonTree() = default;

const JsonNode *JsonTree::find(const JsonNode &object, std::string_view key) const {
    const std::span<const JsonNode> members = children(object);
    if (members.size() <= few_members) {
        return find_member(members, key);
    }
    const auto found = std::ranges::lower_bound(members, key, {}, &JsonNode::key);
    return found == members.end() || found->key() != key ? nullptr : &*found;
}

std::string JsonTree::path(const JsonNode &node) const {
    if (&node == &root_) {
        return file_ + ": ";
    }
    const auto at = static_cast<std::size_t>(&node - nodes_.data());
    const auto holds = [&](const JsonNode &other) {
        return other.kind >= JsonKind::array && at - other.children.first < other.children.count;
    };
    const auto found = std::ranges::find_if(nodes_, holds);
    const JsonNode &parent = found == nodes_.end() ? root_ : *found;
    return parent.kind == JsonKind::object
               ? path(parent, node.key())
               : path(parent) + "[" + std::to_string(at - parent.children.first) + "]";
}

std::string JsonTree::path(const JsonNode &object, std::string_view key) const {
    return path(object) + (&object == &root_ ? "" : ".") + std::string(key);
}

} // namespace paradize::assets
