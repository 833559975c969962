#pragma once
// Part of json_reader.cpp, the one file that includes nlohmann/json.

#include <nlohmann/json.hpp>

#include <cstdint>
#include <set>
#include <string>
#include <vector>

namespace paradize::assets {

/// Looks for a key that appears twice in one object; stops there, and at what is no JSON. (A callback of
/// nlohmann::json::parse could do it too, in time that grows with the square of an object's members.)
struct UniqueKeys : nlohmann::json_sax<nlohmann::json> {
    std::string twice;
    std::vector<std::set<std::string>> open;

    bool null() override { return true; }
    bool boolean(bool /*value*/) override { return true; }
    bool number_integer(std::int64_t /*value*/) override { return true; }
    bool number_unsigned(std::uint64_t /*value*/) override { return true; }
    bool number_float(double /*value*/, const std::string & /*text*/) override { return true; }
    bool string(std::string & /*value*/) override { return true; }
    bool binary(nlohmann::json::binary_t & /*value*/) override { return true; }
    bool start_object(std::size_t /*size*/) override {
        open.emplace_back();
        return true;
    }
    bool end_object() override {
        open.pop_back();
        return true;
    }
    bool key(std::string &name) override {
        const bool fresh = open.back().insert(name).second;
        twice = fresh ? "" : name;
        return fresh;
    }
    bool start_array(std::size_t /*size*/) override { return true; }
    bool end_array() override { return true; }
    bool parse_error(std::size_t /*at*/, const std::string & /*token*/,
                     const nlohmann::json::exception & /*problem*/) override {
        return false; // told by the parse that follows
    }
};

} // namespace paradize::assets
