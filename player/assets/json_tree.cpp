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

namespace ondemand = simdjson::ondemand;

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

/// True if the bytes behind the text that simdjson reads are in the text's last page, where reading cannot
/// fail. The address sanitizer would object even so.
bool has_padding([[maybe_unused]] std::string_view text) {
#if defined(__SANITIZE_ADDRESS__) // of GCC
    return false;
#else
    constexpr std::uintptr_t page = 4096; // the smallest
    const auto end = reinterpret_cast<std::uintptr_t>(text.data()) + text.size();
    return end % page != 0 && end % page + simdjson::SIMDJSON_PADDING <= page;
#endif
}

/// The text from `start`, behind a quote, to the next one. std::nullopt if it holds an escape.
std::optional<std::string_view> plain_text(const char *start) {
    const char *at = start;
    for (; *at != '"'; ++at) { // all strings of the document are closed
        if (*at == '\\') {
            return std::nullopt;
        }
    }
    return std::string_view(start, at);
}

/// Reads a document into the nodes of a tree.
class Builder {
  public:
    Builder(std::string_view text, ondemand::document &document, std::vector<JsonNode> &nodes,
            const std::string &file)
        : text_(text), document_(document), nodes_(nodes), file_(file) {}

    JsonNode root() {
        const ondemand::json_type type = checked(document_.type());
        if (type != ondemand::json_type::array && type != ondemand::json_type::object) {
            throw Error(file_ + ": must hold one JSON object, holds one value alone");
        }
        ondemand::value value = checked(document_.get_value());
        const JsonNode out = node(value, 1);
        if (document_.current_location().error() == simdjson::SUCCESS) {
            fail(simdjson::TRAILING_CONTENT);
        }
        return out;
    }

  private:
    /// depth: how many arrays and objects there would be. key: of a member.
    JsonNode node(ondemand::value &value, std::size_t depth, std::string_view key = {}) {
        const ondemand::json_type type = checked(value.type());
        const bool holds = type == ondemand::json_type::array || type == ondemand::json_type::object;
        if (holds && depth > max_depth) {
            fail(simdjson::DEPTH_ERROR);
        }
        switch (type) {
        case ondemand::json_type::array:
            return container(JsonKind::array, key, checked(value.get_array()),
                             [&](ondemand::value &&entry) { return node(entry, depth + 1); });
        case ondemand::json_type::object:
            return container(JsonKind::object, key, checked(value.get_object()),
                             [&](ondemand::field &&member) {
                                 const auto plain = plain_text(member.key().raw());
                                 const auto name = plain ? *plain : checked(member.unescaped_key());
                                 return node(member.value(), depth + 1, name);
                             });
        case ondemand::json_type::string: {
            const auto plain = plain_text(value.raw_json_token().data() + 1);
            if (plain) {
                checked(value.get_raw_json_string());
            }
            const std::string_view text = plain ? *plain : checked(value.get_string());
            JsonNode out(JsonKind::string, key, text.size());
            out.text_start = text.data();
            return out;
        }
        case ondemand::json_type::boolean: {
            JsonNode out(JsonKind::boolean, key);
            out.truth = checked(value.get_bool());
            return out;
        }
        case ondemand::json_type::null:
            checked(value.is_null());
            return {JsonKind::null, key};
        default: {
            JsonNode out(JsonKind::number, key);
            out.number = checked(value.get_double());
            return out;
        }
        }
    }

    template <typename T>
    T checked(simdjson::simdjson_result<T> &&result) const {
        T out;
        if (const simdjson::error_code error = std::move(result).get(out); error != simdjson::SUCCESS) {
            fail(error);
        }
        return out;
    }

    [[noreturn]] void fail(simdjson::error_code error) const {
        const char *at = nullptr;
        if (error == simdjson::INCOMPLETE_ARRAY_OR_OBJECT ||
            document_.current_location().get(at) != simdjson::SUCCESS) {
            at = text_.data() + text_.size();
        }
        if (error == simdjson::INCORRECT_TYPE) {
            error = simdjson::TAPE_ERROR; // of a literal that begins like true, false or null
        }
        const auto bytes = std::min(static_cast<std::size_t>(at - text_.data()), text_.size());
        throw Error(file_ + ": is not valid JSON: near byte " + std::to_string(bytes) +
                    " of it: " + simdjson::error_message(error));
    }

    JsonNode container(JsonKind kind, std::string_view key, auto entries, const auto &node_of) {
        const std::size_t start = open_.size();
        for (auto entry : entries) {
            if (entry.error() != simdjson::SUCCESS) {
                fail(entry.error());
            }
            const JsonNode child = node_of(std::move(entry).value_unsafe());
            open_.push_back(child);
        }
        const auto first = open_.begin() + static_cast<std::ptrdiff_t>(start);
        if (kind == JsonKind::object) {
            if (const std::optional<std::string_view> twice = sort_members({first, open_.end()})) {
                throw Error(file_ + ": key \"" + std::string(*twice) + "\" appears twice in one object");
            }
        }
        JsonNode out(kind, key);
        out.children = {static_cast<std::uint32_t>(nodes_.size()),
                        static_cast<std::uint32_t>(open_.size() - start)};
        nodes_.insert(nodes_.end(), first, open_.end());
        open_.erase(first, open_.end());
        return out;
    }

    std::string_view text_;
    ondemand::document &document_;
    std::vector<JsonNode> &nodes_;
    const std::string &file_;
    std::vector<JsonNode> open_; // the children so far of the containers that are not closed
};

} // namespace

struct JsonTree::Strings {
    ondemand::parser parser{max_json_bytes};
    simdjson::padded_string copy; // of the text, if it needs padding
};

const char *name_of(JsonKind kind) {
    constexpr std::array<const char *, 6> names{"null", "boolean", "number", "string", "array", "object"};
    return names[static_cast<std::size_t>(kind)];
}

JsonTree::JsonTree(std::string_view text, const std::string &file)
    : file_(file), strings_(std::make_unique<Strings>()) {
    if (!has_padding(text)) {
        strings_->copy = simdjson::padded_string(text);
        text = strings_->copy;
    }
    ondemand::document document;
    if (const simdjson::error_code error =
            strings_->parser.iterate(text.data(), text.size(), text.size() + simdjson::SIMDJSON_PADDING)
                .get(document);
        error != simdjson::SUCCESS) {
        throw Error(file + ": is not valid JSON: " + simdjson::error_message(error));
    }
    nodes_.reserve(most_nodes(text));
    root_ = Builder(text, document, nodes_, file_).root();
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
