#include "obj/lines.hpp"

#include <bit>

#include "obj/digits.hpp"
#include "obj/number.hpp"

namespace paradize::obj {
namespace {

constexpr unsigned most_of_number = 18;        // sign, seven digits, point, eight digits and what ends it
constexpr unsigned most_of_corner = 3 * 9 + 1; // three times eight digits and what ends them

constexpr std::uint64_t whole_tens[] = {1,       10,        100,        1'000,      10'000,
                                        100'000, 1'000'000, 10'000'000, 100'000'000};
constexpr double tens[] = {1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8};

// Any number that ends before `stop`, or at a blank; null where there is none. Apart, and by value, so that a
// cursor can live in registers.
template <typename Real>
struct Read {
    Real value;
    const char *stop;
};
template <typename Real>
[[gnu::noinline]] Read<Real> read_rarely(const char *p, const char *stop) {
    Real value = 0;
    if (read_number(p, stop, value) != NumberFault::none || (p != stop && *p != ' '))
        return {0, nullptr};
    return {value, p};
}

// A place in a line: `at` bytes behind `base`, and the places of what is no digit from there on.
class Cursor {
  public:
    // stop: the end of the line, without its CR and LF. marks: of the text from `marked` on.
    Cursor(const char *p, const char *stop, const char *marked, const std::uint64_t *marks)
        : base_(p), stop_(stop), marked_(marked), marks_(marks) {
        look();
    }

    // Blanks are no digits: each takes a break with it.
    [[gnu::always_inline]] void skip_spaces() {
        while (base_[at_] == ' ') {
            ++at_;
            breaks_ &= breaks_ - 1;
            go_on(1);
        }
    }

    [[gnu::always_inline]] bool at_end() const { return base_ + at_ == stop_; }

    // One decimal number; false where it is not plain and read_number does not take it either.
    template <typename Real>
    [[gnu::always_inline]] bool number(Real &out) {
        go_on(most_of_number);
        const std::uint64_t minus = breaks_ >> at_ & 1;
        std::uint64_t left = breaks_ & (breaks_ - minus);
        const unsigned start = at_ + static_cast<unsigned>(minus);
        const auto point = static_cast<unsigned>(std::countr_zero(left));
        left &= left - 1;
        const auto stop = static_cast<unsigned>(std::countr_zero(left));
        const unsigned whole = point - start, fraction = stop - point - 1;
        // Signs are as good as random: one question for all.
        const bool plain = (base_[point] == '.') & (whole - 1 < 7) & (fraction - 1 < 8) &
                           ((base_[stop] == ' ') | (base_ + stop == stop_)) &
                           ((minus == 0) | (base_[at_] == '-'));
        if (!plain) [[unlikely]]
            return rare_number(out);
        const std::uint64_t mantissa =
            digits(base_ + start, whole) * whole_tens[fraction] + digits(base_ + point + 1, fraction);
        // Both are exact as doubles, so this is the double nearest to the decimal; see obj/number.hpp for the
        // rest.
        const double value = static_cast<double>(static_cast<std::int64_t>(mantissa)) / tens[fraction];
        if ((std::bit_cast<std::uint64_t>(value) & 0x1fffffffu) == 0x10000000u) [[unlikely]]
            return rare_number(out);
        out = static_cast<Real>(
            std::bit_cast<double>(std::bit_cast<std::uint64_t>(value) | std::uint64_t{minus} << 63));
        at_ = stop;
        breaks_ = left;
        return true;
    }

    // One corner of a face whose indices lie in 1 .. have[kind]; false for anything else.
    [[gnu::always_inline]] bool corner(const std::uint32_t have[3], Corner &c) {
        go_on(most_of_corner);
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
        return base_[stop] == ' ' || at_end();
    }

  private:
    void look() {
        const auto from = static_cast<std::size_t>(base_ - marked_);
        const std::uint64_t *word = marks_ + from / 64;
        breaks_ = word[0] >> from % 64 | word[1] << 1 << (63 - from % 64);
    }

    // Looks at the next 64 bytes where fewer than `bytes` are left of these.
    [[gnu::always_inline]] void go_on(unsigned bytes) {
        if (at_ + bytes > 64) {
            base_ += at_;
            at_ = 0;
            look();
        }
    }

    [[gnu::always_inline]] bool index(unsigned from, unsigned stop, std::uint32_t have,
                                      std::uint32_t &value) const {
        const unsigned count = stop - from;
        if (count - 1 > 7)
            return false;
        value = digits(base_ + from, count) - 1;
        return value < have;
    }

    template <typename Real>
    [[gnu::always_inline]] bool rare_number(Real &out) {
        const Read<Real> read = read_rarely<Real>(base_ + at_, stop_);
        if (!read.stop)
            return false;
        out = read.value;
        base_ = read.stop;
        at_ = 0;
        look();
        return true;
    }

    const char *base_;
    const char *const stop_, *const marked_;
    const std::uint64_t *const marks_;
    unsigned at_ = 0;
    std::uint64_t breaks_ = 0;
};

// Where the line at lines.p ends, with its LF; null where it may not be read.
[[gnu::always_inline]] inline const char *line_end(Lines &lines) {
    while (lines.left == 0 && lines.word + 1 < lines.words)
        lines.left = lines.ends[++lines.word];
    const char *const stop = lines.marked + 64 * lines.word + std::countr_zero(lines.left);
    return lines.left != 0 && stop < lines.limit && lines.p < lines.end ? stop : nullptr;
}

[[gnu::always_inline]] inline Cursor behind(const Lines &lines, std::size_t keyword, const char *stop) {
    return {lines.p + keyword, stop - (stop != lines.p && stop[-1] == '\r'), lines.marked, lines.breaks};
}

// Lines of one keyword with `count` numbers, one more where `spare`.
template <typename Real, int count, bool spare, char second>
std::size_t read_numbers(Lines &from, std::size_t most, Real *out) {
    constexpr std::size_t keyword = second == ' ' ? 1 : 2;
    Lines lines = from;
    std::size_t found = 0;
    for (; found < most; ++found) {
        const char *const stop = line_end(lines);
        if (!stop || lines.p[0] != 'v' || lines.p[1] != second || lines.p[keyword] != ' ')
            break;
        Cursor cursor = behind(lines, keyword + 1, stop);
        bool plain = true;
        for (int i = 0; i < count && plain; ++i) {
            cursor.skip_spaces();
            plain = cursor.number(out[i]);
        }
        cursor.skip_spaces();
        Real unused = 0;
        if (spare && plain && !cursor.at_end() && (plain = cursor.number(unused)))
            cursor.skip_spaces();
        if (!plain || !cursor.at_end())
            break;
        out += count;
        lines.left &= lines.left - 1;
        lines.p = stop + 1;
    }
    from = lines;
    return found;
}

std::size_t read_faces(Lines &from, std::size_t most, const std::uint32_t have[3], std::uint64_t line,
                       Corner *&corners, Face *faces) {
    Lines lines = from;
    std::size_t found = 0;
    for (; found < most; ++found) {
        const char *const stop = line_end(lines);
        if (!stop || lines.p[0] != 'f' || lines.p[1] != ' ')
            break;
        Cursor cursor = behind(lines, 2, stop);
        cursor.skip_spaces();
        Corner *next = corners;
        while (cursor.corner(have, *next)) {
            ++next;
            cursor.skip_spaces();
            if (cursor.at_end())
                break;
        }
        if (!cursor.at_end() || next - corners < 3)
            break;
        *faces++ = {static_cast<std::uint32_t>(next - corners), static_cast<std::uint32_t>(line++)};
        corners = next;
        lines.left &= lines.left - 1;
        lines.p = stop + 1;
    }
    from = lines;
    return found;
}

} // namespace

const LineReaders plain_readers{read_numbers<double, 3, false, ' '>, read_numbers<float, 2, true, 't'>,
                                read_numbers<float, 3, false, 'n'>, read_faces};

} // namespace paradize::obj
