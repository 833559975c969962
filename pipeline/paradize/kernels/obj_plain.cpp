#include "obj_plain.hpp"

#include <bit>

#include "obj_digits.hpp"
#include "obj_number.hpp"

namespace paradize::obj {
namespace {

constexpr std::size_t most_corners = 64; // of a plain face

constexpr std::uint64_t whole_tens[] = {1,
                                        10,
                                        100,
                                        1'000,
                                        10'000,
                                        100'000,
                                        1'000'000,
                                        10'000'000,
                                        100'000'000,
                                        1'000'000'000,
                                        10'000'000'000,
                                        100'000'000'000,
                                        1'000'000'000'000,
                                        10'000'000'000'000,
                                        100'000'000'000'000,
                                        1'000'000'000'000'000};
constexpr double tens[] = {1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                           1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};

bool ends(char c) {
    return c == ' ' || c == '\n' || c == '\r';
}

struct Read {
    float value;
    const char *stop; // null: no number, or something behind it
};

// Any number. Apart, and by value, so that a cursor can live in registers.
[[gnu::noinline]] Read read_rarely(const char *p, const char *readable) {
    float value = 0;
    if (read_float(p, readable, value) != NumberFault::none || !ends(*p))
        return {0, nullptr};
    return {value, p};
}

// A place in a line: `at` bytes behind `base`, and the places of what is no digit from there on.
class Cursor {
  public:
    Cursor(const char *p, const char *readable) : base_(p), readable_(readable) { load(); }

    const char *here() const { return base_ + at_; }
    char next() const { return base_[at_]; }

    // Blanks are no digits: each takes a break with it.
    [[gnu::always_inline]] void skip_spaces() {
        while (next() == ' ') {
            ++at_;
            breaks_ &= breaks_ - 1;
            if (at_ >= 48)
                rebase();
        }
    }

    // At the end of a line: its length with the line break, from `here`; 0 where something else follows.
    [[gnu::always_inline]] unsigned line_end() {
        skip_spaces();
        return next() == '\n' ? 1 : next() == '\r' && base_[at_ + 1] == '\n' ? 2 : 0;
    }

    // One decimal number; false where it is not plain and read_float does not take it either.
    [[gnu::always_inline]] bool number(float &out) {
        if (few_breaks() && !rebase())
            return false;
        const std::uint64_t minus = breaks_ >> at_ & 1;
        std::uint64_t left = minus ? breaks_ & (breaks_ - 1) : breaks_;
        const unsigned start = at_ + static_cast<unsigned>(minus);
        const auto point = static_cast<unsigned>(std::countr_zero(left));
        left &= left - 1;
        const auto stop = static_cast<unsigned>(std::countr_zero(left));
        const unsigned whole = point - start, fraction = stop - point - 1;
        if (base_[point] != '.' || whole - 1 > 6 || fraction - 1 > 7 || !ends(base_[stop]) ||
            (minus && base_[at_] != '-'))
            return rare_number(out);
        const std::uint64_t mantissa =
            digits(base_ + start, whole) * whole_tens[fraction] + digits(base_ + point + 1, fraction);
        // Both are exact as doubles, so this is the double nearest to the decimal; see obj_number.hpp for the
        // rest.
        const double value = static_cast<double>(mantissa) / tens[fraction];
        if ((std::bit_cast<std::uint64_t>(value) & 0x1fffffffu) == 0x10000000u)
            return rare_number(out);
        out = std::bit_cast<float>(std::bit_cast<std::uint32_t>(static_cast<float>(value)) |
                                   static_cast<std::uint32_t>(minus) << 31);
        at_ = stop;
        breaks_ = left;
        return true;
    }

    // One corner of a face whose indices lie in 1 .. have[kind]; false for anything else.
    [[gnu::always_inline]] bool corner(const std::uint32_t have[3], Corner &c) {
        if (few_breaks() && !rebase())
            return false;
        std::uint64_t left = breaks_;
        auto stop = static_cast<unsigned>(std::countr_zero(left));
        if (!index(at_, stop, have[0], c.position))
            return false;
        c.uv = c.normal = absent;
        if (base_[stop] == '/') {
            left &= left - 1;
            const unsigned second = stop + 1;
            stop = static_cast<unsigned>(std::countr_zero(left));
            const bool third = base_[stop] == '/';
            if (!(third && stop == second) && !index(second, stop, have[1], c.uv))
                return false;
            if (third) {
                left &= left - 1;
                const unsigned last = stop + 1;
                stop = static_cast<unsigned>(std::countr_zero(left));
                if (!index(last, stop, have[2], c.normal))
                    return false;
            }
        }
        at_ = stop;
        breaks_ = left;
        return ends(base_[stop]);
    }

  private:
    void load() { breaks_ = readable_ - base_ >= reach ? breaks(base_) : 0; }

    bool few_breaks() const {
        const std::uint64_t second = breaks_ & (breaks_ - 1);
        return (second & (second - 1)) == 0;
    }

    // Looks on from here; false where 64 bytes from here do not hold three breaks.
    bool rebase() {
        base_ += at_;
        at_ = 0;
        load();
        return !few_breaks();
    }

    bool index(unsigned from, unsigned stop, std::uint32_t have, std::uint32_t &value) const {
        const unsigned count = stop - from;
        if (count - 1 > 7)
            return false;
        value = digits(base_ + from, count) - 1;
        return value < have;
    }

    [[gnu::always_inline]] bool rare_number(float &out) {
        const Read read = read_rarely(here(), readable_);
        if (!read.stop)
            return false;
        out = read.value;
        base_ = read.stop;
        at_ = 0;
        load();
        return breaks_ != 0;
    }

    const char *base_;
    const char *const readable_;
    unsigned at_ = 0;
    std::uint64_t breaks_ = 0;
};

// `count` numbers behind the keyword, one more where `spare`; the length of the line, or 0.
template <int count, bool spare>
[[gnu::always_inline]] inline const char *numbers(const char *p, const char *readable, float *out) {
    Cursor cursor(p, readable);
    for (int i = 0; i < count; ++i) {
        cursor.skip_spaces();
        if (!cursor.number(out[i]))
            return nullptr;
    }
    unsigned stop = cursor.line_end();
    float unused = 0;
    if (spare && !stop && cursor.number(unused))
        stop = cursor.line_end();
    return stop ? cursor.here() + stop : nullptr;
}

} // namespace

const char *plain_lines(const char *p, const char *end, const char *readable, Elements &elements,
                        std::uint64_t &line) {
    if constexpr (std::endian::native != std::endian::little)
        return p;
    std::uint32_t have[3] = {static_cast<std::uint32_t>(elements.positions.size() / 3),
                             static_cast<std::uint32_t>(elements.uvs.size() / 2),
                             static_cast<std::uint32_t>(elements.normals.size() / 3)};
    while (p < end && readable - p >= 2 * reach) {
        const char *next = nullptr;
        if (p[0] == 'f' && p[1] == ' ' && !elements.new_run) {
            Corner *const corners = elements.corners.room(most_corners);
            std::uint32_t count = 0;
            Cursor cursor(p + 2, readable);
            unsigned stop = 0;
            cursor.skip_spaces();
            while (count < most_corners && cursor.corner(have, corners[count])) {
                ++count;
                if (cursor.next() == ' ')
                    cursor.skip_spaces();
                if ((stop = cursor.next() >= '0' ? 0 : cursor.line_end()))
                    break;
            }
            if (!stop || count < 3)
                return p;
            next = cursor.here() + stop;
            elements.corners.resize(elements.corners.size() + count);
            elements.faces.push_back({count, static_cast<std::uint32_t>(line)});
        } else if (p[0] != 'v') {
            return p;
        } else if (p[1] == ' ' && elements.colors.empty()) {
            float *const into = elements.positions.room(3);
            if (!(next = numbers<3, false>(p + 2, readable, into)))
                return p;
            elements.positions.resize(elements.positions.size() + 3);
            ++have[0];
        } else if (p[1] == 't' && p[2] == ' ') {
            float *const into = elements.uvs.room(2);
            if (!(next = numbers<2, true>(p + 3, readable, into)))
                return p;
            elements.uvs.resize(elements.uvs.size() + 2);
            ++have[1];
        } else if (p[1] == 'n' && p[2] == ' ') {
            float *const into = elements.normals.room(3);
            if (!(next = numbers<3, false>(p + 3, readable, into)))
                return p;
            elements.normals.resize(elements.normals.size() + 3);
            ++have[2];
        } else {
            return p;
        }
        p = next;
        ++line;
    }
    return p;
}

} // namespace paradize::obj
