#pragma once
// Part of json_reader.cpp.

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace paradize::assets {

/// Builds the tree of a document in one pass. Stops at a key that is repeated within one object, and at
/// invalid JSON. (Json::parse keeps the last of two equal keys. Its callback could find them, but in time
/// quadratic in the number of members.)
class UniqueTree : public nlohmann::json_sax<nlohmann::json> {
  public:
    using Json = nlohmann::json;

    /// Writes the tree to `root`, which must outlive this object.
    explicit UniqueTree(Json &root) : root_(root) {}

    std::string duplicate_key; // the repeated key, if there is one
    std::string problem;       // the parser's message

    bool null() override { return add(nullptr); }
    bool boolean(bool value) override { return add(value); }
    bool number_integer(std::int64_t value) override { return add(value); }
    bool number_unsigned(std::uint64_t value) override { return add(value); }
    bool number_float(double value, const std::string & /*text*/) override { return add(value); }
    bool string(std::string &value) override { return add(std::move(value)); }
    bool binary(nlohmann::json::binary_t & /*value*/) override { return false; }
    bool start_object(std::size_t /*size*/) override { return open(Json::value_t::object); }
    bool start_array(std::size_t /*size*/) override { return open(Json::value_t::array); }
    bool end_object() override { return close(); }
    bool end_array() override { return close(); }
    bool key(std::string &name) override {
        const auto [place, fresh] = open_.back()->get_ref<Json::object_t &>().try_emplace(name);
        member_ = &place->second;
        if (!fresh) {
            duplicate_key = name;
        }
        return fresh;
    }
    bool parse_error(std::size_t /*at*/, const std::string & /*token*/,
                     const nlohmann::json::exception &what) override {
        problem = what.what();
        return false;
    }

  private:
    /// Stores a value at the current position: as the document, at an array's end, or as the named member.
    template <typename T>
    Json *put(T &&value) {
        if (open_.empty()) {
            root_ = std::forward<T>(value);
            return &root_;
        }
        if (open_.back()->is_array()) {
            return &open_.back()->get_ref<Json::array_t &>().emplace_back(std::forward<T>(value));
        }
        *member_ = std::forward<T>(value);
        return member_;
    }

    template <typename T>
    bool add(T &&value) {
        put(std::forward<T>(value));
        return true;
    }

    bool open(Json::value_t kind) {
        open_.push_back(put(kind));
        return true;
    }

    bool close() {
        open_.pop_back();
        return true;
    }

    Json &root_;
    Json *member_ = nullptr;
    std::vector<Json *> open_; // stays valid, because an array grows only while its entries are closed
};

} // namespace paradize::assets
