#include "assets/json_reader.hpp"

#include "assets/json_tree.hpp"
#include "error.hpp"
#include "number_text.hpp"

#include <algorithm>
#include <cmath>

namespace paradize::assets {

namespace {

double checked_number(const JsonTree &tree, const JsonNode &node, double low, double high) {
    if (node.kind != JsonKind::number) {
        throw Error(tree.path(node) + ": must be a number, is " + name_of(node.kind));
    }
    if (!(node.number >= low && node.number <= high)) {
        throw Error(tree.path(node) + ": is " + shortest(node.number) +
                    (low <= high ? ", must lie in [" + shortest(low) + ", " + shortest(high) + "]"
                                 : ", but the file has no such entries"));
    }
    return node.number;
}

long long checked_integer(const JsonTree &tree, const JsonNode &node, long long low, long long high) {
    const double number = checked_number(tree, node, static_cast<double>(low), static_cast<double>(high));
    if (number != std::floor(number)) {
        throw Error(tree.path(node) + ": is " + shortest(number) + ", must be a whole number");
    }
    return static_cast<long long>(number);
}

/// Returns the entries of an array.
std::span<const JsonNode> checked_array(const JsonTree &tree, const JsonNode &node, std::size_t least,
                                        std::size_t most) {
    const bool is_array = node.kind == JsonKind::array;
    if (!is_array || node.children.count < least || node.children.count > most) {
        const std::string size =
            is_array ? std::to_string(node.children.count) + " entries" : name_of(node.kind);
        throw Error(tree.path(node) + ": must be an array of " + std::to_string(least) +
                    (least == most ? "" : " to " + std::to_string(most)) + " entries, is " + size);
    }
    return tree.children(node);
}

std::string checked_text(const JsonTree &tree, const JsonNode &node) {
    if (node.kind != JsonKind::string) {
        throw Error(tree.path(node) + ": must be a string, is " + name_of(node.kind));
    }
    return std::string(node.text());
}

} // namespace

JsonObject::JsonObject(const JsonTree &tree, const JsonNode &node) : tree_(&tree), node_(&node) {
    if (node.kind != JsonKind::object) {
        throw Error(tree.path(node) + ": must be an object, is " + name_of(node.kind));
    }
}

const JsonNode *JsonObject::find(std::string_view key) const {
    const JsonNode *found = tree_->find(*node_, key);
    if (found != nullptr) {
        found->was_read = true;
    }
    return found;
}

const JsonNode &JsonObject::member(std::string_view key) const {
    const JsonNode *found = find(key);
    if (found == nullptr) {
        fail(key, "is missing");
    }
    return *found;
}

bool JsonObject::has(std::string_view key) const {
    const JsonNode *found = find(key);
    return found != nullptr && found->kind != JsonKind::null;
}

double JsonObject::number(std::string_view key, double low, double high) const {
    return checked_number(*tree_, member(key), low, high);
}

double JsonObject::number_or(std::string_view key, double low, double high, double fallback) const {
    return has(key) ? number(key, low, high) : fallback;
}

long long JsonObject::integer(std::string_view key, long long low, long long high) const {
    return checked_integer(*tree_, member(key), low, high);
}

long long JsonObject::integer_or(std::string_view key, long long low, long long high,
                                 long long fallback) const {
    return has(key) ? integer(key, low, high) : fallback;
}

bool JsonObject::boolean_or(std::string_view key, bool fallback) const {
    if (!has(key)) {
        return fallback;
    }
    const JsonNode &node = member(key);
    if (node.kind != JsonKind::boolean) {
        fail(key, std::string("must be true or false, is ") + name_of(node.kind));
    }
    return node.truth;
}

std::string JsonObject::text(std::string_view key) const {
    return checked_text(*tree_, member(key));
}

std::string JsonObject::text_or(std::string_view key, std::string fallback) const {
    return has(key) ? text(key) : std::move(fallback);
}

std::vector<double> JsonObject::numbers(std::string_view key, std::size_t count, double low,
                                        double high) const {
    checked_array(*tree_, member(key), count, count);
    return column(key, count, low, high);
}

std::vector<double> JsonObject::column(std::string_view key, std::size_t most, double low,
                                       double high) const {
    const std::span<const JsonNode> entries = checked_array(*tree_, member(key), 0, most);
    std::vector<double> out;
    out.reserve(entries.size());
    for (const JsonNode &entry : entries) {
        out.push_back(checked_number(*tree_, entry, low, high));
    }
    return out;
}

std::vector<long long> JsonObject::integers(std::string_view key, std::size_t most, long long low,
                                            long long high) const {
    const std::span<const JsonNode> entries = checked_array(*tree_, member(key), 0, most);
    std::vector<long long> out;
    out.reserve(entries.size());
    for (const JsonNode &entry : entries) {
        out.push_back(checked_integer(*tree_, entry, low, high));
    }
    return out;
}

std::vector<std::string> JsonObject::texts(std::string_view key, std::size_t most) const {
    const std::span<const JsonNode> entries = checked_array(*tree_, member(key), 0, most);
    std::vector<std::string> out;
    out.reserve(entries.size());
    for (const JsonNode &entry : entries) {
        out.push_back(checked_text(*tree_, entry));
    }
    return out;
}

std::vector<std::vector<double>> JsonObject::rows(std::string_view key, std::size_t most, std::size_t count,
                                                  double low, double high) const {
    checked_array(*tree_, member(key), 1, most);
    const std::vector<double> flat = flat_rows(key, most, count, low, high);
    std::vector<std::vector<double>> out;
    out.reserve(flat.size() / count);
    for (auto row = flat.begin(); row != flat.end(); row += static_cast<std::ptrdiff_t>(count)) {
        out.emplace_back(row, row + static_cast<std::ptrdiff_t>(count));
    }
    return out;
}

std::vector<double> JsonObject::flat_rows(std::string_view key, std::size_t most, std::size_t count,
                                          double low, double high) const {
    const std::span<const JsonNode> rows = checked_array(*tree_, member(key), 0, most);
    std::vector<double> out;
    out.reserve(rows.size() * count);
    for (const JsonNode &row : rows) {
        for (const JsonNode &entry : checked_array(*tree_, row, count, count)) {
            out.push_back(checked_number(*tree_, entry, low, high));
        }
    }
    return out;
}

JsonObject JsonObject::object(std::string_view key) const {
    return {*tree_, member(key)};
}

std::optional<JsonObject> JsonObject::object_or_none(std::string_view key) const {
    return has(key) ? std::optional<JsonObject>(object(key)) : std::nullopt;
}

JsonArray JsonObject::array(std::string_view key, std::size_t most) const {
    const JsonNode &node = member(key);
    checked_array(*tree_, node, 0, most);
    return {*tree_, node};
}

std::vector<JsonObject> JsonObject::objects(std::string_view key, std::size_t most) const {
    const JsonArray entries = array(key, most);
    std::vector<JsonObject> out;
    out.reserve(entries.size());
    for (std::size_t i = 0; i < entries.size(); ++i) {
        out.push_back(entries[i]);
    }
    return out;
}

std::vector<std::string> JsonObject::names() const {
    std::vector<std::string> out;
    for (const JsonNode &member : tree_->children(*node_)) {
        out.emplace_back(member.key());
        member.was_read = true;
    }
    std::ranges::sort(out);
    return out;
}

void JsonObject::ignore(std::initializer_list<std::string_view> keys) const {
    for (const std::string_view key : keys) {
        find(key);
    }
}

void JsonObject::reject_unknown_keys() const {
    for (const JsonNode &member : tree_->children(*node_)) {
        if (!member.was_read) {
            fail(member.key(), "is unknown to this player; bake the scene with the same version of Paradize");
        }
    }
}

void JsonObject::fail(std::string_view key, const std::string &what) const {
    throw Error(tree_->path(*node_, key) + ": " + what);
}

std::size_t JsonArray::size() const {
    return node_->children.count;
}

JsonObject JsonArray::operator[](std::size_t index) const {
    return {*tree_, tree_->children(*node_)[index]};
}

JsonDocument::JsonDocument(std::string_view text, const std::string &file) {
    if (text.size() > max_json_bytes) {
        throw Error(file + ": " + std::to_string(text.size()) + " bytes of JSON, the limit is " +
                    std::to_string(max_json_bytes));
    }
    tree_ = std::make_unique<JsonTree>(text, file);
    if (const JsonKind kind = tree_->root().kind; kind != JsonKind::object) {
        throw Error(file + ": must hold one JSON object, holds " + name_of(kind));
    }
}

JsonDocument::~JsonDocument() = default;

JsonObject JsonDocument::root() const {
    return {*tree_, tree_->root()};
}

} // namespace paradize::assets
