#include "app/free_camera.hpp"
#include "app/messages.hpp"
#include "app/png.hpp"
#include "app/report.hpp"
#include "error.hpp"
#include "files.hpp"
#include "number_text.hpp"

#include <doctest/doctest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <png.h>
#include <vector>

using namespace paradize;

TEST_CASE("PNG: pixels are read back unchanged, first row at the top") {
    const test::Folder folder;
    std::vector<std::uint8_t> pixels(3 * 2 * 3);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        pixels[i] = static_cast<std::uint8_t>(i * 13);
    }
    const auto path = folder.path() / "new" / "a.png";
    write_png(path, pixels, 3, 2);
    png_image image;
    std::memset(&image, 0, sizeof image);
    image.version = PNG_IMAGE_VERSION;
    REQUIRE(png_image_begin_read_from_file(&image, path.c_str()) != 0);
    image.format = PNG_FORMAT_RGB;
    CHECK(image.width == 3);
    std::vector<std::uint8_t> back(PNG_IMAGE_SIZE(image));
    REQUIRE(png_image_finish_read(&image, nullptr, back.data(), 0, nullptr) != 0);
    CHECK(back == pixels);
}

TEST_CASE("PNG: a failed write gives an error and no partial file") {
    const test::Folder folder;
    folder.write("a.png/inside", std::string("x")); // the name is taken by a folder
    const std::vector<std::uint8_t> pixels(3);
    CHECK_THROWS_AS(write_png(folder.path() / "a.png", pixels, 1, 1), Error);
    int entries = 0;
    for ([[maybe_unused]] const auto &entry : std::filesystem::directory_iterator(folder.path())) {
        ++entries;
    }
    CHECK(entries == 1);
}

TEST_CASE("report: a terrain of more than 2 GiB of device memory gives a warning") {
    CHECK(terrain_warning(std::uint64_t{2} << 30U).empty());
    const std::string words = terrain_warning(std::uint64_t{3} << 30U);
    CHECK(words.find("3072 MiB") != std::string::npos);
    CHECK(words.find("max_error_m") != std::string::npos);
}

TEST_CASE("report: median of the frames, and escaped JSON") {
    CHECK(median({}) == 0.0);
    CHECK(median({3.0, 1.0, 100.0}) == 3.0);
    CHECK(percentile({}, 0.95) == 0.0);
    CHECK(percentile({7.0}, 0.95) == 7.0);
    std::vector<double> values;
    for (int i = 100; i > 0; --i) {
        values.push_back(i);
    }
    CHECK(percentile(values, 0.95) == 95.0);
    CHECK(percentile(values, 0.951) == 96.0);
    CHECK(percentile(values, 1.0) == 100.0);
    CHECK(percentile(values, 1e-6) == 1.0);
    Report report;
    report.renderer = "a \"b\"\\\n";
    CHECK(to_json(report).find("bench") == std::string::npos);
    report.bench = true;
    report.frame_ms = {2.0, 1.0, 9.0};
    report.passes_ms = {{"sky", 0.5}, {"post", 0.25}};
    const std::string json = to_json(report);
    CHECK(
        json.find(
            R"("bench": {"median_ms": 2.000, "p95_ms": 9.000, "low_ms": 1.000, "high_ms": 9.000, )"
            R"("passes_ms": {"sky": 0.500, "post": 0.250}, "passes_clock": "processor", "frames_ms": [2.000, 1.000, 9.000]})") !=
        std::string::npos);
    CHECK(json.find(R"("quality": {"shadow": "balanced", )") != std::string::npos);
    CHECK(bench_line(report).starts_with("3 frames of 0 x 0: median 2.000 ms, 95th percentile 9.000 ms, a "));
    CHECK(json.find(R"("gl_renderer": "a \"b\"\\\u000a")") != std::string::npos);
    CHECK(peak_rss_bytes() > 1000000);
    CHECK(program_bytes() > 10000);
    const std::vector<std::string> libraries = shared_libraries();
    CHECK(std::any_of(libraries.begin(), libraries.end(),
                      [](const std::string &name) { return name.starts_with("libc.so"); }));
}

TEST_CASE("messages: control bytes of a broken file are escaped") {
    const std::string plain = "plain\nname\t\xC3\xA9 \xF0\x9F\x8C\xB4";
    CHECK(printable(plain) == plain);
    CHECK(printable("\x1B[2J\x7F") == "\\x1B[2J\\x7F");
    CHECK(printable(std::string_view("\0\r", 2)) == "\\x00\\x0D");
    CHECK(printable("\xFF\xC0\x80 \xE2\x82") == "\\xFF\\xC0\\x80 \\xE2\\x82");
    CHECK(printable("\xED\xA0\x80") == "\\xED\\xA0\\x80");          // half of a surrogate pair
    CHECK(printable("\xF5\x80\x80\x80") == "\\xF5\\x80\\x80\\x80"); // above the Unicode range
    CHECK(printable("\xC2\x9B"
                    "31m") == "\\u{9B}31m"); // CSI of a terminal in one character
    CHECK(printable("\xE2\x80\xAE"
                    "bin.exe") == "\\u{202E}bin.exe"); // reverses the text that follows
    CHECK(printable("a\xE2\x80\xA8"
                    "b\xEF\xBB\xBF") == "a\\u{2028}b\\u{FEFF}"); // line separator, zero-width space
    CHECK(printable("\xF3\xA0\x81\x81") == "\\u{E0041}");
}

TEST_CASE("messages: numbers that differ look different") {
    CHECK(shortest(1.0) == "1");
    CHECK(shortest(std::nextafter(1.0, 2.0)) == "1.0000000000000002");
    CHECK(shortest(0.1F) == "0.1");
    CHECK(shortest(std::numeric_limits<double>::quiet_NaN()) == "nan");
    CHECK(fixed(2.0 / 3.0, 3) == "0.667");
    CHECK(fixed(std::numeric_limits<double>::max(), 3).size() == 313);
}

TEST_CASE("free camera: starts at the flight's pose and moves along its view") {
    FreeCamera camera({{1.0, 2.0, 3.0}, {1.0, 2.0, -7.0}, 0.0});
    const Pose start = camera.pose();
    CHECK(glm::distance(start.eye, glm::dvec3(1.0, 2.0, 3.0)) < 1e-12);
    CHECK(start.target.z == doctest::Approx(2.0));
    Input input;
    input.forward = 1.0F;
    camera.move(input, 0.5);
    CHECK(camera.pose().eye.z == doctest::Approx(1.0)); // 4 m/s
    input = Input();
    input.pitch_px = -100000.0;
    camera.move(input, 0.1);
    CHECK(camera.pose().target.y - camera.pose().eye.y > 0.99);
    CHECK(camera.pose().target.y - camera.pose().eye.y < 1.0); // pitch stays below 90 degrees
    CHECK(camera.pose().roll_rad == 0.0);
    input = Input();
    input.roll = 1.0F;
    camera.move(input, 0.5);
    CHECK(camera.pose().roll_rad == doctest::Approx(0.3));
    input = Input();
    input.up = 1.0F;
    input.fast = true;
    const double before_m = camera.pose().eye.y;
    camera.move(input, 0.5);
    CHECK(camera.pose().eye.y - before_m == doctest::Approx(10.0)); // five times as fast
}

TEST_CASE("panel: the window's title says what is resident, needed and missing") {
    StreamingCounts counts;
    counts.resident_bytes = 12'340'000;
    counts.total_bytes = 45'000'000;
    counts.needed_bytes = 20'000'000;
    counts.evictions = 3;
    CHECK(panel_line("Isle", counts) ==
          "Isle: 12.3 of 45.0 MB resident, 20.0 MB needed, 3 evictions, nothing missing, 0 MB/s read");
    counts.worst_error = 2.5F;
    counts.read_bytes_per_s = 123.4e6;
    CHECK(panel_line("Isle", counts).ends_with("worst error 2.50 x the accepted one, 123 MB/s read"));
}
