#pragma once
// Strict reading of JSON objects. Each member is read by name and checked against a range. Unknown members
// are errors.

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace paradize::assets {

/// Limit of a document. The pipeline writes none that is larger.
inline constexpr std::size_t max_json_bytes = std::size_t{64} << 20U;

class JsonObject;
class JsonTree;
struct JsonNode;

/// An array of objects. The document must outlive it.
class JsonArray {
  public:
    JsonArray(const JsonTree &tree, const JsonNode &node) : tree_(&tree), node_(&node) {}

    std::size_t size() const;
    /// Throws Error if the entry is not an object.
    JsonObject operator[](std::size_t index) const;

  private:
    const JsonTree *tree_;
    const JsonNode *node_;
};

/// One object of a document, which must outlive it. Errors name the file and the path, as in
/// `file: objects[2].radius_m: ...`.
class JsonObject {
  public:
    /// Throws Error if the node is not an object.
    JsonObject(const JsonTree &tree, const JsonNode &node);

    /// True if the member exists and is not null. Counts as read.
    bool has(std::string_view key) const;
    double number(std::string_view key, double low, double high) const;
    double number_or(std::string_view key, double low, double high, double fallback) const;
    /// Throws Error for a fraction.
    long long integer(std::string_view key, long long low, long long high) const;
    long long integer_or(std::string_view key, long long low, long long high, long long fallback) const;
    bool boolean_or(std::string_view key, bool fallback) const;
    std::string text(std::string_view key) const;
    std::string text_or(std::string_view key, std::string fallback) const; // the fallback also replaces null
    /// An array of exactly `count` numbers, each within the range.
    std::vector<double> numbers(std::string_view key, std::size_t count, double low, double high) const;
    /// An array of at most `most` numbers, each within the range.
    std::vector<double> column(std::string_view key, std::size_t most, double low, double high) const;
    std::vector<long long> integers(std::string_view key, std::size_t most, long long low,
                                    long long high) const;
    std::vector<std::string> texts(std::string_view key, std::size_t most) const;
    /// An array of 1 to `most` rows of `count` numbers.
    std::vector<std::vector<double>> rows(std::string_view key, std::size_t most, std::size_t count,
                                          double low, double high) const;
    /// The same rows concatenated into one array, which may be empty.
    std::vector<double> flat_rows(std::string_view key, std::size_t most, std::size_t count, double low,
                                  double high) const;
    JsonObject object(std::string_view key) const;
    std::optional<JsonObject> object_or_none(std::string_view key) const; // nullopt: absent or null
    JsonArray array(std::string_view key, std::size_t most) const;
    std::vector<JsonObject> objects(std::string_view key, std::size_t most) const;
    /// The names of all members, sorted. All count as read.
    std::vector<std::string> names() const;
    /// Marks members as read without reading them.
    void ignore(std::initializer_list<std::string_view> keys) const;
    /// Throws Error if the object has members that were not read.
    void reject_unknown_keys() const;
    [[noreturn]] void fail(std::string_view key, const std::string &what) const;

  private:
    const JsonNode *find(std::string_view key) const;   // nullptr: no such member
    const JsonNode &member(std::string_view key) const; // throws Error if there is no such member

    const JsonTree *tree_;
    const JsonNode *node_;
};

class JsonDocument {
  public:
    /// `text` must outlive the document. Throws Error if it is not one JSON object in UTF-8, exceeds 64 MiB
    /// or repeats a key in an object.
    JsonDocument(std::string_view text, const std::string &file);
    ~JsonDocument();
    JsonDocument(const JsonDocument &) = delete;
    JsonDocument &operator=(const JsonDocument &) = delete;
    JsonObject root() const;

  private:
    std::unique_ptr<JsonTree> tree_;
};

} // namespace paradize::assets
