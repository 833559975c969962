// Only this file and unique_tree.hpp include nlohmann/json, because it takes seconds to compile.
#include "assets/json_reader.hpp"

#include "assets/unique_tree.hpp"
#include "error.hpp"
#include "number_text.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace paradize::assets {

namespace {

using Json = nlohmann::json;

const Json &json(const void *value) {
    return *static_cast<const Json *>(value);
}

/// The path of a value. It is formatted only for an error, because a document may have a million values.
struct JsonPath {
    const std::string &object;
    std::string_view key;
    std::ptrdiff_t row = -1, column = -1; // index in an array and in an array inside it; -1: none

    [[nodiscard]] std::string text() const {
        std::string out = object + (object.ends_with(": ") ? "" : ".") + std::string(key);
        for (const std::ptrdiff_t index : {row, column}) {
            out += index < 0 ? "" : "[" + std::to_string(index) + "]";
        }
        return out;
    }
};

double checked_number(const Json &value, const JsonPath &path, double low, double high) {
    if (!value.is_number()) {
        throw Error(path.text() + ": must be a number, is " + value.type_name());
    }
    const double number = value.get<double>();
    if (!(number >= low && number <= high)) {
        throw Error(path.text() + ": is " + shortest(number) +
                    (low <= high ? ", must lie in [" + shortest(low) + ", " + shortest(high) + "]"
                                 : ", but the file has no such entries"));
    }
    return number;
}

long long checked_integer(const Json &value, const JsonPath &path, long long low, long long high) {
    const double number = checked_number(value, path, static_cast<double>(low), static_cast<double>(high));
    if (number != std::floor(number)) {
        throw Error(path.text() + ": is " + shortest(number) + ", must be a whole number");
    }
    return static_cast<long long>(number);
}

void check_array(const Json &value, const JsonPath &path, std::size_t least, std::size_t most) {
    if (!value.is_array() || value.size() < least || value.size() > most) {
        const std::string size =
            value.is_array() ? std::to_string(value.size()) + " entries" : value.type_name();
        throw Error(path.text() + ": must be an array of " + std::to_string(least) +
                    (least == most ? "" : " to " + std::to_string(most)) + " entries, is " + size);
    }
}

std::string checked_text(const Json &value, const JsonPath &path) {
    if (!value.is_string()) {
        throw Error(path.text() + ": must be a string, is " + value.type_name());
    }
    return value.get<std::string>();
}

} // namespace

JsonObject::JsonObject(const void *value, std::string path) : value_(value), path_(std::move(path)) {
    if (!json(value_).is_object()) {
        throw Error(path_ + ": must be an object, is " + json(value_).type_name());
    }
}

const void *JsonObject::find(std::string_view key) const {
    const auto found = json(value_).find(key);
    if (found == json(value_).end()) {
        return nullptr;
    }
    if (read_members_.empty()) {
        read_members_.reserve(8);
    }
    read_members_.push_back(&*found);
    return &*found;
}

const void *JsonObject::member(std::string_view key) const {
    const void *found = find(key);
    if (found == nullptr) {
        fail(key, "is missing");
    }
    return found;
}

bool JsonObject::has(std::string_view key) const {
    const void *found = find(key);
    return found != nullptr && !json(found).is_null();
}

double JsonObject::number(std::string_view key, double low, double high) const {
    return checked_number(json(member(key)), {path_, key}, low, high);
}

double JsonObject::number_or(std::string_view key, double low, double high, double fallback) const {
    return has(key) ? number(key, low, high) : fallback;
}

long long JsonObject::integer(std::string_view key, long long low, long long high) const {
    return checked_integer(json(member(key)), {path_, key}, low, high);
}

long long JsonObject::integer_or(std::string_view key, long long low, long long high,
                                 long long fallback) const {
    return has(key) ? integer(key, low, high) : fallback;
}

bool JsonObject::boolean_or(std::string_view key, bool fallback) const {
    if (!has(key)) {
        return fallback;
    }
    const Json &value = json(member(key));
    if (!value.is_boolean()) {
        fail(key, std::string("must be true or false, is ") + value.type_name());
    }
    return value.get<bool>();
}

std::string JsonObject::text(std::string_view key) const {
    return checked_text(json(member(key)), {path_, key});
}

std::string JsonObject::text_or(std::string_view key, std::string fallback) const {
    return has(key) ? text(key) : std::move(fallback);
}

std::vector<double> JsonObject::numbers(std::string_view key, std::size_t count, double low,
                                        double high) const {
    check_array(json(member(key)), {path_, key}, count, count);
    return column(key, count, low, high);
}

std::vector<double> JsonObject::column(std::string_view key, std::size_t most, double low,
                                       double high) const {
    const Json &array = json(member(key));
    check_array(array, {path_, key}, 0, most);
    std::vector<double> out;
    out.reserve(array.size());
    for (std::size_t i = 0; i < array.size(); ++i) {
        out.push_back(checked_number(array[i], {path_, key, static_cast<std::ptrdiff_t>(i)}, low, high));
    }
    return out;
}

std::vector<long long> JsonObject::integers(std::string_view key, std::size_t most, long long low,
                                            long long high) const {
    const Json &array = json(member(key));
    check_array(array, {path_, key}, 0, most);
    std::vector<long long> out;
    out.reserve(array.size());
    for (std::size_t i = 0; i < array.size(); ++i) {
        out.push_back(checked_integer(array[i], {path_, key, static_cast<std::ptrdiff_t>(i)}, low, high));
    }
    return out;
}

std::vector<std::string> JsonObject::texts(std::string_view key, std::size_t most) const {
    const Json &array = json(member(key));
    check_array(array, {path_, key}, 0, most);
    std::vector<std::string> out;
    out.reserve(array.size());
    for (std::size_t i = 0; i < array.size(); ++i) {
        out.push_back(checked_text(array[i], {path_, key, static_cast<std::ptrdiff_t>(i)}));
    }
    return out;
}

std::vector<std::vector<double>> JsonObject::rows(std::string_view key, std::size_t most, std::size_t count,
                                                  double low, double high) const {
    check_array(json(member(key)), {path_, key}, 1, most);
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
    const Json &array = json(member(key));
    check_array(array, {path_, key}, 0, most);
    std::vector<double> out;
    out.reserve(array.size() * count);
    for (std::size_t i = 0; i < array.size(); ++i) {
        const auto row = static_cast<std::ptrdiff_t>(i);
        check_array(array[i], {path_, key, row}, count, count);
        for (std::size_t k = 0; k < count; ++k) {
            out.push_back(
                checked_number(array[i][k], {path_, key, row, static_cast<std::ptrdiff_t>(k)}, low, high));
        }
    }
    return out;
}

JsonObject JsonObject::object(std::string_view key) const {
    return {member(key), JsonPath{path_, key}.text()};
}

std::optional<JsonObject> JsonObject::object_or_none(std::string_view key) const {
    return has(key) ? std::optional<JsonObject>(object(key)) : std::nullopt;
}

JsonArray JsonObject::array(std::string_view key, std::size_t most) const {
    const Json &array = json(member(key));
    check_array(array, {path_, key}, 0, most);
    return {&array, JsonPath{path_, key}.text()};
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
    for (const auto &item : json(value_).items()) {
        out.push_back(item.key());
        read_members_.push_back(&item.value());
    }
    return out;
}

void JsonObject::ignore(std::initializer_list<std::string_view> keys) const {
    for (const std::string_view key : keys) {
        find(key);
    }
}

void JsonObject::reject_unknown_keys() const {
    for (const auto &item : json(value_).items()) {
        if (std::ranges::find(read_members_, &item.value()) == read_members_.end()) {
            fail(item.key(), "is unknown to this player; bake the scene with the same version of Paradize");
        }
    }
}

void JsonObject::fail(std::string_view key, const std::string &what) const {
    throw Error(JsonPath{path_, key}.text() + ": " + what);
}

std::size_t JsonArray::size() const {
    return json(value_).size();
}

JsonObject JsonArray::operator[](std::size_t index) const {
    return {&json(value_)[index], path_ + "[" + std::to_string(index) + "]"};
}

struct JsonDocument::Value {
    Json json;
};

JsonDocument::JsonDocument(std::string_view text, const std::string &file)
    : value_(std::make_unique<Value>()), file_(file) {
    if (text.size() > max_json_bytes) {
        throw Error(file + ": " + std::to_string(text.size()) + " bytes of JSON, the limit is " +
                    std::to_string(max_json_bytes));
    }
    UniqueTree tree(value_->json);
    if (!Json::sax_parse(text, &tree)) {
        if (!tree.duplicate_key.empty()) {
            throw Error(file + ": key \"" + tree.duplicate_key + "\" appears twice in one object");
        }
        // "[json.exception.parse_error.101] parse error at line ..."
        const std::size_t code = tree.problem.starts_with('[') ? tree.problem.find("] ") : std::string::npos;
        throw Error(file + ": is not valid JSON: " +
                    (code == std::string::npos ? tree.problem : tree.problem.substr(code + 2)));
    }
    if (!value_->json.is_object()) {
        throw Error(file + ": must hold one JSON object, holds " + value_->json.type_name());
    }
}

JsonDocument::~JsonDocument() = default;

JsonObject JsonDocument::root() const {
    return {&value_->json, file_ + ": "};
}

} // namespace paradize::assets
