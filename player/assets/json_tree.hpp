#pragma once
// A parsed JSON document as one array of nodes. Part of json_reader.cpp.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace paradize::assets {

enum class JsonKind : std::uint8_t { null, boolean, number, string, array, object };

/// The kind's name in messages.
const char *name_of(JsonKind kind);

/// 24 bytes: a large document has so many nodes that getting memory for them takes longer than parsing.
struct JsonNode {
    /// The entries of an array or the members of an object: nodes that follow one another.
    struct Range {
        std::uint32_t first, count;
    };

    /// `key`: of a member, else empty. text_bytes: of a string.
    JsonNode(JsonKind kind_of, std::string_view key, std::size_t bytes = 0)
        : key_start(key.data()), number(0.0), key_bytes(key.size() & most_bytes),
          text_bytes(bytes & most_bytes), kind(kind_of), was_read(false) {}
    JsonNode() : JsonNode(JsonKind::null, {}) {}

    std::string_view key() const { return {key_bytes == 0 ? "" : key_start, key_bytes}; } // of a member
    std::string_view text() const { return {text_start, text_bytes}; }                    // of a string

    static constexpr std::uint64_t most_bytes = (1U << 30U) - 1; // documents are shorter: max_json_bytes
    const char *key_start;
    union {
        double number;
        const char *text_start;
        Range children;
        bool truth;
    };
    std::uint64_t key_bytes : 30, text_bytes : 30;
    JsonKind kind : 3;
    mutable bool was_read : 1; // of a member: somebody has looked it up
};

/// A document of JSON, parsed by simdjson. Nothing is allocated per value, because a scene with many
/// instances has a million of them.
class JsonTree {
  public:
    /// `text` must outlive the tree. Throws Error if it is not one JSON object or array in UTF-8, nests
    /// deeper than 256 arrays and objects, holds a number beyond a double's range, or repeats a key within
    /// one object. `file` begins the message.
    JsonTree(std::string_view text, const std::string &file);
    ~JsonTree();

    const JsonNode &root() const { return root_; }
    /// The entries or members of an array or object. Members of large objects are sorted by key.
    std::span<const JsonNode> children(const JsonNode &of) const {
        return std::span(nodes_).subspan(of.children.first, of.children.count);
    }
    /// The member of an object, or nullptr.
    const JsonNode *find(const JsonNode &object, std::string_view key) const;
    /// Where the node stands: "file: objects[2].radius_m"; of the root "file: ". It is found again by a
    /// search, which only errors need.
    std::string path(const JsonNode &node) const;
    /// The path of a member, existing or not.
    std::string path(const JsonNode &object, std::string_view key) const;

  private:
    struct Strings; // the bytes of texts and keys with escapes; of all, where the text is copied

    std::string file_;
    std::unique_ptr<Strings> strings_;
    JsonNode root_;
    std::vector<JsonNode> nodes_; // children before their parents
};

} // namespace paradize::assets
