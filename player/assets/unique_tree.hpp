#pragma once
// Part of json_reader.cpp, the one file that includes nlohmann/json.

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace paradize::assets {

/// Builds the tree of a document in one walk through its text; stops at a key that appears twice in one
/// object, and at what is no JSON. (Json::parse keeps the last of two; its callback could find them, in time
/// that grows with the square of an object's members.)
class UniqueTree : public nlohmann::json_sax<nlohmann::json> {
  public:
    using Json = nlohmann::json;

    /// The tree is put into `root`, which outlives this.
    explicit UniqueTree(Json &root) : root_(root) {}

    std::string duplicate_key; // the key, when there is one
    std::string problem;       // what the parser complains of

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
    /// Puts a value where the walk is: the document itself, an array's end, or the member that was named.
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
    std::vector<Json *> open_; // an array grows only while what is in it is closed
};

} // namespace paradize::assets
