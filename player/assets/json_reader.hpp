#pragma once
// Strict reading of JSON objects: every member is asked for by name, with its range, or refused.

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

/// Of a document; the pipeline writes none that is larger.
inline constexpr std::size_t max_json_bytes = std::size_t{64} << 20U;

class JsonObject;

/// An array of objects, which are made when they are asked for.
class JsonArray {
  public:
    JsonArray(const void *value, std::string path) : value_(value), path_(std::move(path)) {}

    std::size_t size() const;
    /// Throws Error when the entry is no object.
    JsonObject operator[](std::size_t index) const;

  private:
    const void *value_;
    std::string path_;
};

/// One object of a document. Errors name the document's file and the place, as in `file: objects[2].radius_m:
/// ...`.
class JsonObject {
  public:
    JsonObject(const void *value, std::string path);

    const std::string &path() const { return path_; }
    /// Is the member there, and not null? (Counts as asked for.)
    bool has(std::string_view key) const;
    double number(std::string_view key, double low, double high) const;
    double number_or(std::string_view key, double low, double high, double fallback) const;
    /// A whole number; refuses fractions.
    long long integer(std::string_view key, long long low, long long high) const;
    long long integer_or(std::string_view key, long long low, long long high, long long fallback) const;
    bool boolean_or(std::string_view key, bool fallback) const;
    std::string text(std::string_view key) const;
    std::string text_or(std::string_view key, std::string fallback) const; // also for null
    /// An array of `count` numbers, each in the range.
    std::vector<double> numbers(std::string_view key, std::size_t count, double low, double high) const;
    /// An array of at most `most` numbers, each in the range.
    std::vector<double> column(std::string_view key, std::size_t most, double low, double high) const;
    std::vector<long long> integers(std::string_view key, std::size_t most, long long low,
                                    long long high) const;
    std::vector<std::string> texts(std::string_view key, std::size_t most) const;
    /// An array of rows of `count` numbers.
    std::vector<std::vector<double>> rows(std::string_view key, std::size_t most, std::size_t count,
                                          double low, double high) const;
    /// The same rows, one after the other in one array; it may be empty.
    std::vector<double> flat_rows(std::string_view key, std::size_t most, std::size_t count, double low,
                                  double high) const;
    JsonObject object(std::string_view key) const;
    std::optional<JsonObject> object_or_none(std::string_view key) const; // none: absent or null
    JsonArray array(std::string_view key, std::size_t most) const;
    std::vector<JsonObject> objects(std::string_view key, std::size_t most) const;
    /// Names of all members, in the document's order of names (sorted); they count as asked for.
    std::vector<std::string> names() const;
    /// Members that may be there and are not read.
    void ignore(std::initializer_list<std::string_view> keys) const;
    /// Refuses members that nobody asked for.
    void reject_unknown_keys() const;
    [[noreturn]] void fail(std::string_view key, const std::string &what) const;

  private:
    const void *find(std::string_view key) const;   // nullptr: it is not there
    const void *member(std::string_view key) const; // throws Error when it is not there

    const void *value_;
    std::string path_;
    mutable std::vector<const void *> read_members_; // members
};

class JsonDocument {
  public:
    /// Throws Error when the text is no JSON object, longer than 64 MiB, not UTF-8, or has a key twice.
    JsonDocument(std::string_view text, const std::string &file);
    ~JsonDocument();
    JsonDocument(const JsonDocument &) = delete;
    JsonDocument &operator=(const JsonDocument &) = delete;
    JsonObject root() const;

  private:
    struct Value;
    std::unique_ptr<Value> value_;
    std::string file_;
};

} // namespace paradize::assets
