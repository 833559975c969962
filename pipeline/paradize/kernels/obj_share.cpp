#include "obj_share.hpp"

#include <algorithm>
#include <bit>

#include "unify.hpp"

namespace paradize::obj {
namespace {

// Vertices at each position in a list; false, with nothing of use, where lists grow so long that hashing is
// quicker.
bool share_by_lists(std::span<const Corner> corners, std::size_t positions, IndexShared &out) {
    constexpr std::size_t steps_a_corner = 8;
    struct Entry {
        std::uint32_t uv, normal, next;
    };
    Buffer<std::uint32_t> head;
    head.assign(positions, absent);
    Buffer<Entry> entries;
    std::uint32_t *const numbers = out.vertex_of_corner.room(corners.size());
    std::size_t steps_left = steps_a_corner * corners.size() + 64;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const Corner c = corners[i];
        std::uint32_t *link = &head[c.position];
        std::uint32_t at = *link;
        while (at != absent && (entries[at].uv != c.uv || entries[at].normal != c.normal)) {
            link = &entries[at].next;
            at = *link;
            if (--steps_left == 0)
                return false;
        }
        if (at == absent) {
            at = static_cast<std::uint32_t>(entries.size());
            *link = at; // before `entries` may move
            entries.push_back({c.uv, c.normal, absent});
            out.vertices.push_back(c);
        }
        numbers[i] = at;
    }
    out.vertex_of_corner.resize(corners.size());
    return true;
}

void share_by_hash(std::span<const Corner> corners, IndexShared &out) {
    const Numbered found = number_equal(
        corners.size(),
        [&](std::size_t i) {
            const Corner &c = corners[i];
            return mix(mix(mix(hash_seed, c.position), c.uv), c.normal);
        },
        [&](std::size_t a, std::size_t b) { return corners[a] == corners[b]; });
    out.vertex_of_corner.append(std::span(found.index));
    for (const std::uint32_t first : found.first)
        out.vertices.push_back(corners[first]);
}

constexpr std::size_t widest = 12; // of all pieces together

std::uint32_t index_of(const Corner &c, int kind) {
    return kind == 0 ? c.position : kind == 1 ? c.uv : c.normal;
}

// Two to four floats: too short for a call.
inline void copy_row(const float *from, std::size_t width, float *to) {
    to[0] = from[0];
    to[1] = from[1];
    if (width > 2)
        to[2] = from[2];
    if (width > 3)
        to[3] = from[3];
}

std::uint64_t hash_of(const float *row, std::size_t width) {
    std::uint64_t h = hash_seed;
    for (std::size_t k = 0; k < width; k += 2) {
        const std::uint64_t low = float_key(row[k]), high = k + 1 < width ? float_key(row[k + 1]) : 0;
        h = (std::rotl(h, 23) ^ (low | high << 32)) * 0x9e3779b97f4a7c15ull;
    }
    return h ^ h >> 32;
}

} // namespace

IndexShared share_by_index(std::span<const Corner> corners, std::size_t positions) {
    IndexShared out;
    if (!share_by_lists(corners, positions, out)) {
        out = IndexShared();
        share_by_hash(corners, out);
    }
    return out;
}

void share_by_value(std::span<const Corner> vertices, std::span<const Piece> pieces,
                    Buffer<std::uint32_t> &triangles) {
    constexpr std::size_t block = 32; // vertices whose places in the table are fetched together
    const std::size_t count = vertices.size();
    std::size_t width = 0;
    for (const Piece &piece : pieces) {
        piece.out->room(count * piece.width);
        width += piece.width;
    }
    Buffer<std::uint64_t> table; // number + 1 of a vertex under the upper half of its hash; 0: empty
    table.assign(std::bit_ceil(std::max<std::size_t>(count, 8) * 2), 0);
    const std::size_t mask = table.size() - 1;
    Buffer<std::uint32_t> number;
    std::size_t found = 0;
    float rows[block][widest];
    std::uint64_t hashes[block];
    number.resize(count);
    for (std::size_t first = 0; first < count; first += block) {
        const std::size_t here = std::min(block, count - first);
        for (std::size_t i = 0; i < here; ++i) {
            float *into = rows[i];
            for (const Piece &piece : pieces) {
                const std::uint32_t index = index_of(vertices[first + i], piece.kind);
                if (index == absent)
                    std::fill_n(into, piece.width, 0.0f);
                else
                    copy_row(&piece.rows[index * piece.width], piece.width, into);
                if (piece.kind == 1 && index != absent)
                    into[1] = 1.0f - into[1];
                into += piece.width;
            }
            hashes[i] = hash_of(rows[i], width);
            __builtin_prefetch(&table[hashes[i] & mask], 1);
        }
        for (std::size_t i = 0; i < here; ++i) {
            const std::uint64_t tag = hashes[i] & 0xffffffff00000000ull;
            std::size_t slot = hashes[i] & mask;
            std::uint64_t held = 0;
            while ((held = table[slot]) != 0) {
                if ((held & 0xffffffff00000000ull) == tag) {
                    const std::size_t other = (held & 0xffffffffu) - 1;
                    const float *mine = rows[i];
                    bool equal = true;
                    for (const Piece &piece : pieces) {
                        equal = equal &&
                                std::equal(mine, mine + piece.width, piece.out->data() + other * piece.width);
                        mine += piece.width;
                    }
                    if (equal)
                        break;
                }
                slot = (slot + 1) & mask;
            }
            if (held != 0) {
                number[first + i] = static_cast<std::uint32_t>((held & 0xffffffffu) - 1);
                continue;
            }
            const float *mine = rows[i];
            for (const Piece &piece : pieces) {
                copy_row(mine, piece.width, piece.out->data() + found * piece.width);
                mine += piece.width;
            }
            number[first + i] = static_cast<std::uint32_t>(found++);
            table[slot] = tag | found;
        }
    }
    for (const Piece &piece : pieces)
        piece.out->resize(found * piece.width);
    if (found != count)
        for (std::uint32_t &vertex : triangles)
            vertex = number[vertex];
}

} // namespace paradize::obj
