#include "assets/json_tree.hpp"

#include "assets/json_parser.hpp"

#include <algorithm>
#include <array>

namespace paradize::assets {

const char *name_of(JsonKind kind) {
    constexpr std::array<const char *, 6> names{"null", "boolean", "number", "string", "array", "object"};
    return names[static_cast<std::size_t>(kind)];
}

JsonTree::JsonTree(std::string_view text, const std::string &file) : file_(file) {
    JsonParser(text, *this).parse();
}

const JsonNode *JsonTree::find(const JsonNode &object, std::string_view key) const {
    const std::span<const JsonNode> members = children(object);
    const auto found = members.size() > few_members
                           ? std::ranges::lower_bound(members, key, {}, &JsonNode::key)
                           : std::ranges::find(members, key, &JsonNode::key);
    return found == members.end() || found->key != key ? nullptr : &*found;
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
               ? path(parent, node.key)
               : path(parent) + "[" + std::to_string(at - parent.children.first) + "]";
}

std::string JsonTree::path(const JsonNode &object, std::string_view key) const {
    return path(object) + (&object == &root_ ? "" : ".") + std::string(key);
}

} // namespace paradize::assets
