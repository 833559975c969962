#include "obj/share.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "unify.hpp"

namespace paradize::obj {
namespace {

constexpr std::uint64_t upper_half = 0xffffffff00000000ull;

const double *text_of(const Corner &c, const Rows &from) {
    return &from.positions[c.position * std::size_t{3}];
}

// A vertex's numbers in one row: those of the attributes that there are, packed.
template <bool has_uv, bool has_normal, bool has_color>
struct Layout {
    static constexpr std::size_t uv = 3, normal = uv + 2 * has_uv, color = normal + 3 * has_normal,
                                 width = color + 4 * has_color;

    static void read(const Corner &c, const Rows &from, float *row) {
        const double *text = text_of(c, from);
        for (std::size_t k = 0; k < 3; ++k)
            row[k] = local(text[k], from.origin[k]);
        if constexpr (has_uv) {
            row[uv] = c.uv == absent ? 0 : from.uvs[c.uv * std::size_t{2}];
            row[uv + 1] = c.uv == absent ? 0 : 1 - from.uvs[c.uv * std::size_t{2} + 1];
        }
        if constexpr (has_normal) {
            if (c.normal == absent)
                std::memset(row + normal, 0, 12);
            else
                std::memcpy(row + normal, &from.normals[c.normal * std::size_t{3}], 12);
        }
        if constexpr (has_color)
            std::memcpy(row + color, &from.colors[c.position * std::size_t{4}], 16);
    }

    static std::uint64_t hash(const float *row) {
        std::uint64_t h = hash_seed;
        for (std::size_t k = 0; k < width; k += 2) {
            const std::uint64_t low = float_key(row[k]), high = k + 1 < width ? float_key(row[k + 1]) : 0;
            h = (std::rotl(h, 23) ^ (low | high << 32)) * 0x9e3779b97f4a7c15ull;
        }
        return h ^ h >> 32;
    }

    static bool equal(const float *row, const Parsed &out, std::size_t i) {
        bool same = std::equal(row, row + 3, &out.positions[i * 3]);
        if constexpr (has_uv)
            same = same && std::equal(row + uv, row + uv + 2, &out.uvs[i * 2]);
        if constexpr (has_normal)
            same = same && std::equal(row + normal, row + normal + 3, &out.normals[i * 3]);
        if constexpr (has_color)
            same = same && std::equal(row + color, row + color + 4, &out.colors[i * 4]);
        return same;
    }

    static void write(const float *row, Parsed &out, std::size_t i) {
        std::memcpy(&out.positions[i * 3], row, 12);
        if constexpr (has_uv)
            std::memcpy(&out.uvs[i * 2], row + uv, 8);
        if constexpr (has_normal)
            std::memcpy(&out.normals[i * 3], row + normal, 12);
        if constexpr (has_color)
            std::memcpy(&out.colors[i * 4], row + color, 16);
    }

    static void resize(Parsed &out, std::size_t count) {
        out.positions.resize(count * 3);
        out.uvs.resize(has_uv ? count * 2 : 0);
        out.normals.resize(has_normal ? count * 3 : 0);
        out.colors.resize(has_color ? count * 4 : 0);
    }
};

// How far, squared, a vertex lies from a position that became it.
double apart(const float *vertex, const double *text, const Origin &origin) {
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double off = text[k] - origin[k] - static_cast<double>(vertex[k]);
        sum += off * off;
    }
    return sum;
}

// Whether the positions of a triangle's vertices have an area that is more than float64 can make of none.
bool has_area(const std::uint32_t *triangle, std::span<const Vertices::Vertex> vertices, const Rows &from) {
    double a[3], b[3], size = 0, reach = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double p = text_of(vertices[triangle[0]].corner, from)[k];
        a[k] = text_of(vertices[triangle[1]].corner, from)[k] - p;
        b[k] = text_of(vertices[triangle[2]].corner, from)[k] - p;
        size = std::max({size, std::fabs(a[k]), std::fabs(b[k])});
        reach = std::max(reach, std::fabs(p));
    }
    double most = 0;
    for (std::size_t k = 0; k < 3 && size > 0; ++k) {
        const std::size_t u = (k + 1) % 3, v = (k + 2) % 3;
        most = std::max(most, std::fabs(a[u] / size * (b[v] / size) - a[v] / size * (b[u] / size)));
    }
    return size > 0 && most > 0x1p-50 * (reach + size) / size;
}

template <typename Row>
void share(std::span<const Vertices::Vertex> vertices, const Rows &from, Parsed &out) {
    constexpr std::size_t block = 32; // vertices whose places in the table are fetched together
    const std::size_t count = vertices.size();
    Row::resize(out, count);
    out.texts.resize(count * 3);
    // Number + 1 of a vertex under the upper half of its hash; 0: empty.
    Buffer<std::uint64_t> table;
    table.assign(std::bit_ceil(std::max<std::size_t>(count, 8) * 2), 0);
    const std::size_t mask = table.size() - 1;
    Buffer<std::uint32_t> number;
    number.resize(count);
    std::size_t found = 0;
    float rows[block][Row::width];
    std::uint64_t hashes[block];
    for (std::size_t first = 0; first < count; first += block) {
        const std::size_t here = std::min(block, count - first);
        for (std::size_t i = 0; i < here; ++i) {
            Row::read(vertices[first + i].corner, from, rows[i]);
            hashes[i] = Row::hash(rows[i]);
            __builtin_prefetch(&table[hashes[i] & mask], 1);
        }
        for (std::size_t i = 0; i < here; ++i) {
            const std::uint64_t tag = hashes[i] & upper_half;
            std::size_t slot = hashes[i] & mask;
            std::uint64_t held = 0;
            while ((held = table[slot]) != 0 &&
                   !((held & upper_half) == tag && Row::equal(rows[i], out, (held & ~upper_half) - 1)))
                slot = (slot + 1) & mask;
            const double *text = text_of(vertices[first + i].corner, from);
            if (held == 0) {
                std::memcpy(&out.texts[found * 3], text, 24);
                Row::write(rows[i], out, found++);
                held = table[slot] = tag | found;
            }
            const std::size_t at = (held & ~upper_half) - 1;
            if (!std::equal(text, text + 3, &out.texts[at * 3]) &&
                apart(rows[i], text, from.origin) > apart(rows[i], &out.texts[at * 3], from.origin))
                std::memcpy(&out.texts[at * 3], text, 24);
            number[first + i] = static_cast<std::uint32_t>(at);
        }
    }
    Row::resize(out, found);
    out.texts.resize(found * 3);
    if (found == count)
        return;
    for (std::size_t i = 0; i + 2 < out.triangles.size(); i += 3) {
        std::uint32_t *triangle = &out.triangles[i];
        const std::uint32_t a = number[triangle[0]], b = number[triangle[1]], c = number[triangle[2]];
        if ((a == b || b == c || c == a) && has_area(triangle, vertices, from) && out.collapsed++ == 0)
            out.first_collapsed = static_cast<std::uint32_t>(i / 3);
        triangle[0] = a;
        triangle[1] = b;
        triangle[2] = c;
    }
}

std::uint64_t hash_of(const Corner &c) {
    return mix(mix(mix(hash_seed, c.position), c.uv), c.normal);
}

} // namespace

void Vertices::fill_table(std::size_t slots) {
    table_.assign(slots, absent);
    for (std::size_t i = 0; i < vertices_.size(); ++i) {
        std::size_t slot = hash_of(vertices_[i].corner) & (slots - 1);
        while (table_[slot] != absent)
            slot = (slot + 1) & (slots - 1);
        table_[slot] = static_cast<std::uint32_t>(i);
    }
}

std::uint32_t Vertices::hashed(const Corner &corner) {
    if (vertices_.size() * 2 >= table_.size())
        fill_table(std::bit_ceil(vertices_.size() * 4 + 64));
    const std::size_t mask = table_.size() - 1;
    std::size_t slot = hash_of(corner) & mask;
    while (table_[slot] != absent && !(vertices_[table_[slot]].corner == corner))
        slot = (slot + 1) & mask;
    if (table_[slot] == absent) {
        table_[slot] = static_cast<std::uint32_t>(vertices_.size());
        vertices_.push_back({corner, absent});
    }
    return table_[slot];
}

void share_by_value(std::span<const Vertices::Vertex> vertices, const Rows &rows, Parsed &out) {
    using Share = void (*)(std::span<const Vertices::Vertex>, const Rows &, Parsed &);
    constexpr Share shares[] = {&share<Layout<false, false, false>>, &share<Layout<true, false, false>>,
                                &share<Layout<false, true, false>>,  &share<Layout<true, true, false>>,
                                &share<Layout<false, false, true>>,  &share<Layout<true, false, true>>,
                                &share<Layout<false, true, true>>,   &share<Layout<true, true, true>>};
    shares[!rows.uvs.empty() + 2 * !rows.normals.empty() + 4 * !rows.colors.empty()](vertices, rows, out);
}

} // namespace paradize::obj
