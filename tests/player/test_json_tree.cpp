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

std::string error_of(const std::string &text) {
    try {
        const JsonTree tree(text, "f");
    } catch (const Error &error) {
        return error.what();
    }
    return "";
}

std::string text_of(const std::string &json) {
    const JsonTree tree(json, "f");
    REQUIRE(tree.root().kind == JsonKind::string);
    return std::string(tree.root().text);
}

double number_of(const std::string &json) {
    const JsonTree tree(json, "f");
    REQUIRE(tree.root().kind == JsonKind::number);
    return tree.root().number;
}

} // namespace

TEST_CASE("JSON: every number is the double nearest to its digits") {
    std::vector<std::string> texts{"0",
                                   "-0",
                                   "0.5",
                                   "-12.25e2",
                                   "1E+2",
                                   "1e-5",
                                   "1e22",
                                   "1e23",
                                   "1e-22",
                                   "123456789012345678901234567890",
                                   "4e-324",
                                   "1e-400",
                                   "0.1",
                                   "9007199254740993",
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

TEST_CASE("JSON: what is no JSON is refused, with the place") {
    const std::string value = "must be null, true, false, a number, a string, an array or an object";
    const std::vector<std::pair<std::string, std::string>> cases{
        {"", "line 1, column 1: the text ends where a value must stand"},
        {"[1,\n 2,]", "line 2, column 4: " + value},
        {"[1 2]", "line 1, column 4: a comma or ] must follow a value"},
        {"{\"a\" 1}", "line 1, column 6: a colon must follow a key"},
        {"{a: 1}", "line 1, column 2: a key must be a string"},
        {"{\"a\": 1,}", "a key must be a string"},
        {"{\"a\": 1", "a comma or } must follow a value"},
        {"[1] x", "line 1, column 5: nothing may follow the document"},
        {"nul", value},
        {"-null", value},
        {"+1", value},
        {"NaN", value},
        {"-", value},
        {"'a'", value},
        {"01", "a number must not begin with 0"},
        {"1.", "a digit must stand here"},
        {".5", value},
        {"1e", "a digit must stand here"},
        {"[1e400]", "line 1, column 2: no double is as large as this number"},
        {"\"a", "the text ends within a string"},
        {"\"a\\", "the text ends within a string"},
        {"\"a\nb\"", "a control character stands in a string"},
        {"\"\\x\"", "a backslash must precede one of"},
        {"\"\\u12g4\"", "four hexadecimal digits must follow"},
        {"\"\\ud83c\"", "half a surrogate pair stands alone"},
        {"\"\\udf34\\ud83c\"", "half a surrogate pair stands alone"},
        {"\"\\ud83c\\u0041\"", "half a surrogate pair stands alone"},
        {"\"\xC3\"", "a string is not UTF-8"},
        {"\"\xC0\x80\"", "a string is not UTF-8"},         // longer than needed
        {"\"\xED\xA0\x80\"", "a string is not UTF-8"},     // half a surrogate pair
        {"\"\xF4\x90\x80\x80\"", "a string is not UTF-8"}, // beyond Unicode
        {"\"\xE2\x82", "a string is not UTF-8"},           // cut off
        {std::string(257, '['), "nests deeper than 256"},
    };
    for (const auto &[text, part] : cases) {
        INFO(text);
        const std::string error = error_of(text);
        CHECK(error.starts_with("f: is not valid JSON: parse error at line "));
        CHECK(error.find(part) != std::string::npos);
    }
    CHECK(error_of(std::string(256, '[') + std::string(256, ']')).empty());
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
        CHECK(error_of(text + "\"m0\": 1}") == "f: key \"m0\" appears twice in one object");
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
