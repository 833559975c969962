// The statements of an OBJ file, one by one: what none of the quicker ways takes, and all that is said of
// faults.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "obj/assemble.hpp"
#include "obj/parse.hpp"
#include "obj/plain.hpp"
#include "obj/text.hpp"

namespace paradize::obj {

class Statements : Text {
  public:
    explicit Statements(const Limits &limits) : limits_(limits) {}

    // Reads whole lines; only the last of the last call may lack its end. From the end of `lines` on, `slack`
    // more bytes may be read, whatever they are.
    void feed(std::string_view lines, std::size_t slack);
    // Call it once, after the last line: checks the indices that point ahead and, without faults, assembles.
    Parsed finish();

  private:
    static std::string text_of(std::initializer_list<std::string_view> parts);
    void note(std::string_view what);
    void fault(std::string what);
    void fault_at(std::string what, std::uint64_t line);
    std::uint32_t name(std::string_view text);
    void set(std::uint32_t &field, std::uint32_t value);
    std::string_view token_or_empty();
    void limit(std::uint64_t count);
    bool is_below_limits(std::size_t bytes) const;

    // One statement that PlainLines left, by its keyword.
    void statement();
    void other(std::string_view word);
    void polypaint(std::string_view text);
    void position();
    void smoothing();
    static bool is_no_finite_number(std::string_view word);
    template <typename Real>
    bool number(Real &value, const char *keyword);
    // Reads between `least` and `most` numbers and appends `kept` of them, zeros where fewer were given, or
    // where one is not finite.
    void numbers(Buffer<float> &into, int least, int most, int kept, const char *keyword);

    enum class Kind : std::uint8_t { position, uv, normal };

    // The message for a position index that names none of `have`; `where` is said when there are none.
    static std::string out_of_range(std::int64_t given, std::uint64_t have, std::string_view where);
    // One index of a corner: moves past it. False (and a fault) on anything but a whole number, and on a
    // position that cannot be there. Texture coordinates and normals that are not there are dropped at the
    // end.
    bool index(Kind kind, std::uint64_t have, std::uint32_t &value);
    bool corner(Corner &c);
    // Appends a face's corners, and a run where object, group, material or smoothing changed.
    void face();
    static bool same_state(const Run &a, const Run &b);
    // Faces may come before what they name: the largest position index is checked at the end.
    void check_forward_references();
    void drop_broken_references();

    const Limits limits_;
    std::uint64_t keywords_ = 0;
    bool full_ = false;
    Elements elements_;
    Buffer<float> painted_;          // 4, RGBA, of each position: what ZBrush says of it
    std::uint64_t painted_line_ = 0; // the first of it; 0: there is none
    PlainLines plain_;
    Run state_{0, absent, absent, absent, absent};
    std::pair<std::int64_t, std::uint64_t> furthest_ = {}; // position index ahead of its vertex, and its line
    bool any_broken_ = false;
    std::unordered_map<std::string, std::uint32_t> name_of_;
    Parsed out_;
    Notes notes_{out_.notes};
};

} // namespace paradize::obj
