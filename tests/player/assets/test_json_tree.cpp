#include "assets/json_tree.hpp"

#include "error.hpp"

#include <doctest/doctest.h>

#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <utility>
#include <vector>

using namespace paradize;
using assets::JsonKind;
using assets::JsonNode;
using assets::JsonTree;

namespace {

std::string parse_error(const std::string &text) {
    try {
        const JsonTree tree(text, "f");
    } catch (const Error &error) {
        return error.what();
    }
    return "";
}

std::string text_of(const std::string &json) {
    const std::string text = "[" + json + "]";
    const JsonTree tree(text, "f");
    const JsonNode &only = tree.children(tree.root())[0];
    REQUIRE(only.kind == JsonKind::string);
    return std::string(only.text());
}

double number_of(const std::string &json) {
    const std::string text = "[" + json + "]";
    const JsonTree tree(text, "f");
    const JsonNode &only = tree.children(tree.root())[0];
    REQUIRE(only.kind == JsonKind::number);
    return only.number;
}

} // namespace

TEST_CASE("JSON: every number is the double nearest to its digits") {
    std::vector<std::string> texts{"0",
                                   "0.5",
                                   "-12.25e2",
                                   "1E+2",
                                   "1e-5",
                                   "1e22",
                                   "1e23",
                                   "1e-22",
                                   "4e-324",
                                   "1e-400",
                                   "0.1",
                                   "9007199254740993",
                                   "123456789012345678901234567890",
                                   "1.7976931348623157e308",
                                   "0.000000000000000000000000012",
                                   "9007199254740992e-22",
                                   "1e0000000000001",
                                   "2.2250738585072011e-308",
                                   "8.5e-1000000000000"};
    std::mt19937_64 engine(1);
    for (int i = 0; i < 2000; ++i) {
        const int digits = 1 + static_cast<int>(engine() % 20);
        std::string text = engine() % 2 == 0 ? "-" : "";
        text += static_cast<char>('1' + engine() % 9);
        for (int k = 1; k < digits; ++k) {
            text += (k == digits / 2 ? "." : "") + std::to_string(engine() % 10);
        }
        texts.push_back(text + "e" + std::to_string(static_cast<int>(engine() % 60) - 30));
    }
    for (const std::string &text : texts) {
        INFO(text);
        const double found = number_of(text);
        const double nearest = std::strtod(text.c_str(), nullptr);
        CHECK(std::memcmp(&found, &nearest, sizeof found) == 0);
    }
}

TEST_CASE("JSON: strings keep what escapes and UTF-8 say") {
    CHECK(text_of(R"("plain")") == "plain");
    CHECK(text_of(R"("a\"\\\/\b\f\n\r\tz")") == "a\"\\/\b\f\n\r\tz");
    CHECK(text_of(R"("\u0041\u00e9\u20AC\ud83c\udf34!")") == "A\xC3\xA9\xE2\x82\xAC\xF0\x9F\x8C\xB4!");
    CHECK(text_of("\"\xC3\xA9\xE2\x82\xAC\xF0\x9F\x8C\xB4\"") == "\xC3\xA9\xE2\x82\xAC\xF0\x9F\x8C\xB4");
    CHECK(text_of(R"("\u0000")") == std::string(1, '\0'));
}

TEST_CASE("JSON: what is not JSON is refused") {
    for (const std::string text : {"",
                                   "[1,\n 2,]",
                                   "[1 2]",
                                   "{\"a\" 1}",
                                   "{a: 1}",
                                   "{\"a\": 1,}",
                                   "{\"a\": 1",
                                   "[1] x",
                                   "[nul]",
                                   "[nulle]",
                                   "[true-]",
                                   "[null4]",
                                   "[-null]",
                                   "[+1]",
                                   "[NaN]",
                                   "[-]",
                                   "['a']",
                                   "[01]",
                                   "[1.]",
                                   "[.5]",
                                   "[1e]",
                                   "[1e400]",
                                   "\"a",
                                   "\"a\\",
                                   "\"a\nb\"",
                                   "[\"\\x\"]",
                                   "[\"\\u12g4\"]",
                                   "[\"\\ud83c\"]",
                                   "[\"\\ud83c\\u0041\"]",
                                   "\"\xC3\"",
                                   "\"\xC0\x80\"",
                                   "\"\xED\xA0\x80\"",
                                   "\"\xF4\x90\x80\x80\"",
                                   "\"\xE2\x82"}) {
        INFO(text);
        CHECK(parse_error(text).starts_with("f: is not valid JSON: "));
    }
    CHECK(parse_error("[1,\n 2,]").find(": near byte 7 of it: ") != std::string::npos);
    CHECK(parse_error("{\"a\": 1} {}").find(": near byte 9 of it: ") != std::string::npos);
    const auto nested = [](std::size_t depth) { return std::string(depth, '[') + std::string(depth, ']'); };
    CHECK(parse_error(nested(256)).empty());
    CHECK(parse_error("[" + nested(256) + "]").starts_with("f: is not valid JSON: "));
}

TEST_CASE("JSON: a value alone is no document") {
    for (const std::string text : {"1", "null ", "\"a\"", "true", "false-"}) {
        CHECK(parse_error(text) == "f: must hold one JSON object, holds one value alone");
    }
    CHECK(parse_error("{\"a\": 1} x").find(": near byte 9 of it: Unexpected trailing") != std::string::npos);
}

TEST_CASE("JSON: members are found by name, in small objects and large ones, and never twice") {
    for (const int count : {1, 5, 16, 17, 500}) {
        std::string text = "{";
        for (int i = 0; i < count; ++i) {
            text += "\"m" + std::to_string(i) + "\": " + std::to_string(i) + ", ";
        }
        const std::string whole = text + "\"last\": null}";
        const JsonTree tree(whole, "f");
        REQUIRE(tree.children(tree.root()).size() == static_cast<std::size_t>(count) + 1);
        for (int i = 0; i < count; ++i) {
            const JsonNode *found = tree.find(tree.root(), "m" + std::to_string(i));
            REQUIRE(found != nullptr);
            CHECK(found->number == i);
        }
        CHECK(tree.find(tree.root(), "m") == nullptr);
        CHECK(tree.find(tree.root(), "zzz") == nullptr);
        CHECK(parse_error(text + "\"m0\": 1}") == "f: key \"m0\" appears twice in one object");
    }
}

TEST_CASE("JSON: a value knows the path to it") {
    const JsonTree tree(R"({"a": [[1, 2], {"b c": {"d": true}}], "e": {}})", "f");
    const auto a = tree.children(*tree.find(tree.root(), "a"));
    CHECK(tree.path(tree.root()) == "f: ");
    CHECK(tree.path(a[0]) == "f: a[0]");
    CHECK(tree.path(tree.children(a[0])[1]) == "f: a[0][1]");
    const JsonNode &inner = *tree.find(a[1], "b c");
    CHECK(tree.path(*tree.find(inner, "d")) == "f: a[1].b c.d");
    CHECK(tree.path(inner, "none") == "f: a[1].b c.none");
    CHECK(tree.path(tree.root(), "none") == "f: none");
    const JsonTree list("[[], [7]]", "f");
    CHECK(list.path(list.children(list.children(list.root())[1])[0]) == "f: [1][0]");
}
