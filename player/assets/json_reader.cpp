// The one file that, with unique_keys.hpp, includes nlohmann/json (it costs seconds to compile).
#include "assets/json_reader.hpp"

#include "assets/unique_keys.hpp"
#include "error.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace paradize::assets {

namespace {

using Json = nlohmann::json;

constexpr std::size_t most_bytes = std::size_t{64} << 20U;

const Json &json(const void *value) {
    return *static_cast<const Json *>(value);
}

std::string child(const std::string &place, std::string_view key) {
    return place + (place.ends_with(": ") ? "" : ".") + std::string(key);
}

std::string shown(double value) {
    std::ostringstream text;
    text.precision(15);
    text << value;
    return text.str();
}

double checked_number(const Json &value, const std::string &place, double low, double high) {
    if (!value.is_number()) {
        throw Error(place + ": must be a number, is " + value.type_name());
    }
    const double number = value.get<double>();
    if (!(number >= low && number <= high)) {
        throw Error(place + ": is " + shown(number) + ", must lie in [" + shown(low) + ", " + shown(high) +
                    "]");
    }
    return number;
}

long long checked_integer(const Json &value, const std::string &place, long long low, long long high) {
    const double number = checked_number(value, place, static_cast<double>(low), static_cast<double>(high));
    if (number != std::floor(number)) {
        throw Error(place + ": is " + shown(number) + ", must be a whole number");
    }
    return static_cast<long long>(number);
}

void check_array(const Json &value, const std::string &place, std::size_t least, std::size_t most) {
    if (!value.is_array() || value.size() < least || value.size() > most) {
        const std::string size =
            value.is_array() ? std::to_string(value.size()) + " entries" : value.type_name();
        throw Error(place + ": must be an array of " + std::to_string(least) +
                    (least == most ? "" : " to " + std::to_string(most)) + " entries, is " + size);
    }
}

std::string checked_text(const Json &value, const std::string &place) {
    if (!value.is_string()) {
        throw Error(place + ": must be a string, is " + value.type_name());
    }
    return value.get<std::string>();
}

std::string at(const std::string &place, std::size_t index) {
    return place + "[" + std::to_string(index) + "]";
}

} // namespace

JsonObject::JsonObject(const void *value, std::string place) : value_(value), place_(std::move(place)) {
    if (!json(value_).is_object()) {
        throw Error(place_ + ": must be an object, is " + json(value_).type_name());
    }
}

bool JsonObject::has(std::string_view key) const {
    asked_.emplace_back(key);
    const auto found = json(value_).find(key);
    return found != json(value_).end() && !found->is_null();
}

namespace {

const Json &member(const void *value, const std::string &place, std::string_view key) {
    const auto found = json(value).find(key);
    if (found == json(value).end()) {
        throw Error(child(place, key) + ": is missing");
    }
    return *found;
}

} // namespace

double JsonObject::number(std::string_view key, double low, double high) const {
    asked_.emplace_back(key);
    return checked_number(member(value_, place_, key), child(place_, key), low, high);
}

double JsonObject::number_or(std::string_view key, double low, double high, double otherwise) const {
    return has(key) ? number(key, low, high) : otherwise;
}

long long JsonObject::integer(std::string_view key, long long low, long long high) const {
    asked_.emplace_back(key);
    return checked_integer(member(value_, place_, key), child(place_, key), low, high);
}

long long JsonObject::integer_or(std::string_view key, long long low, long long high,
                                 long long otherwise) const {
    return has(key) ? integer(key, low, high) : otherwise;
}

bool JsonObject::boolean_or(std::string_view key, bool otherwise) const {
    if (!has(key)) {
        return otherwise;
    }
    const Json &value = member(value_, place_, key);
    if (!value.is_boolean()) {
        fail(key, std::string("must be true or false, is ") + value.type_name());
    }
    return value.get<bool>();
}

std::string JsonObject::text(std::string_view key) const {
    asked_.emplace_back(key);
    return checked_text(member(value_, place_, key), child(place_, key));
}

std::string JsonObject::text_or(std::string_view key, std::string otherwise) const {
    return has(key) ? text(key) : std::move(otherwise);
}

std::vector<double> JsonObject::numbers(std::string_view key, std::size_t count, double low,
                                        double high) const {
    check_array(member(value_, place_, key), child(place_, key), count, count);
    return column(key, count, low, high);
}

std::vector<double> JsonObject::column(std::string_view key, std::size_t most, double low,
                                       double high) const {
    asked_.emplace_back(key);
    const std::string place = child(place_, key);
    const Json &array = member(value_, place_, key);
    check_array(array, place, 0, most);
    std::vector<double> out;
    out.reserve(array.size());
    for (std::size_t i = 0; i < array.size(); ++i) {
        out.push_back(checked_number(array[i], at(place, i), low, high));
    }
    return out;
}

std::vector<long long> JsonObject::integers(std::string_view key, std::size_t most, long long low,
                                            long long high) const {
    asked_.emplace_back(key);
    const std::string place = child(place_, key);
    const Json &array = member(value_, place_, key);
    check_array(array, place, 0, most);
    std::vector<long long> out;
    out.reserve(array.size());
    for (std::size_t i = 0; i < array.size(); ++i) {
        out.push_back(checked_integer(array[i], at(place, i), low, high));
    }
    return out;
}

std::vector<std::string> JsonObject::texts(std::string_view key, std::size_t most) const {
    asked_.emplace_back(key);
    const std::string place = child(place_, key);
    const Json &array = member(value_, place_, key);
    check_array(array, place, 0, most);
    std::vector<std::string> out;
    out.reserve(array.size());
    for (std::size_t i = 0; i < array.size(); ++i) {
        out.push_back(checked_text(array[i], at(place, i)));
    }
    return out;
}

std::vector<std::vector<double>> JsonObject::rows(std::string_view key, std::size_t most, std::size_t count,
                                                  double low, double high) const {
    check_array(member(value_, place_, key), child(place_, key), 1, most);
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
    asked_.emplace_back(key);
    const std::string place = child(place_, key);
    const Json &array = member(value_, place_, key);
    check_array(array, place, 0, most);
    std::vector<double> out;
    out.reserve(array.size() * count);
    for (std::size_t i = 0; i < array.size(); ++i) {
        check_array(array[i], at(place, i), count, count);
        for (std::size_t k = 0; k < count; ++k) {
            out.push_back(checked_number(array[i][k], at(at(place, i), k), low, high));
        }
    }
    return out;
}

JsonObject JsonObject::object(std::string_view key) const {
    asked_.emplace_back(key);
    return {&member(value_, place_, key), child(place_, key)};
}

std::optional<JsonObject> JsonObject::object_or_none(std::string_view key) const {
    return has(key) ? std::optional<JsonObject>(object(key)) : std::nullopt;
}

std::vector<JsonObject> JsonObject::objects(std::string_view key, std::size_t most) const {
    asked_.emplace_back(key);
    const std::string place = child(place_, key);
    const Json &array = member(value_, place_, key);
    check_array(array, place, 0, most);
    std::vector<JsonObject> out;
    out.reserve(array.size());
    for (std::size_t i = 0; i < array.size(); ++i) {
        out.emplace_back(&array[i], at(place, i));
    }
    return out;
}

std::vector<std::string> JsonObject::names() const {
    std::vector<std::string> out;
    for (const auto &item : json(value_).items()) {
        out.push_back(item.key());
        asked_.push_back(item.key());
    }
    return out;
}

void JsonObject::ignore(std::initializer_list<std::string_view> keys) const {
    asked_.insert(asked_.end(), keys.begin(), keys.end());
}

void JsonObject::done() const {
    for (const auto &item : json(value_).items()) {
        if (std::find(asked_.begin(), asked_.end(), item.key()) == asked_.end()) {
            fail(item.key(), "is not known to this player; bake the scene with the same version of Paradize");
        }
    }
}

void JsonObject::fail(std::string_view key, const std::string &what) const {
    throw Error(child(place_, key) + ": " + what);
}

struct JsonDocument::Value {
    Json json;
};

JsonDocument::JsonDocument(std::string_view text, const std::string &file)
    : value_(std::make_unique<Value>()), file_(file) {
    if (text.size() > most_bytes) {
        throw Error(file + ": " + std::to_string(text.size()) + " bytes of JSON, at most " +
                    std::to_string(most_bytes) + " are taken");
    }
    UniqueKeys unique;
    Json::sax_parse(text, &unique);
    if (!unique.twice.empty()) {
        throw Error(file + ": key \"" + unique.twice + "\" appears twice in one object");
    }
    try {
        value_->json = Json::parse(text);
    } catch (const Json::exception &problem) {
        const std::string text = problem.what(); // "[json.exception.parse_error.101] parse error at line ..."
        const std::size_t code = text.starts_with('[') ? text.find("] ") : std::string::npos;
        throw Error(file + ": is no JSON: " + (code == std::string::npos ? text : text.substr(code + 2)));
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
