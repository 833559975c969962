#include "context.hpp"
#include "error.hpp"
#include "files.hpp"
#include "gl/buffer.hpp"
#include "gl/debug.hpp"
#include "gl/device_memory.hpp"
#include "gl/draw.hpp"
#include "gl/framebuffer.hpp"
#include "gl/program.hpp"
#include "gl/shader_library.hpp"
#include "gl/texture.hpp"
#include "passes/pass_meter.hpp"

#include <doctest/doctest.h>
#include <epoxy/gl.h>
#include <glm/mat3x3.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <string>
#include <sys/resource.h>
#include <tuple>
#include <utility>
#include <vector>

using namespace paradize;

namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool sanitizer_replaces_malloc = true;
#else
constexpr bool sanitizer_replaces_malloc = false;
#endif

const char *const vertex_text =
    "layout(location = 0) in vec3 position;\nvoid main() { gl_Position = vec4(position, 1.0); }\n";

bool alive(const gl::Buffer &buffer) {
    glBindBuffer(GL_ARRAY_BUFFER, buffer.name()); // a name becomes a buffer when it is bound
    return glIsBuffer(buffer.name()) == GL_TRUE;
}

} // namespace

TEST_CASE("handle: a default handle has name zero and is empty") {
    const gl::Texture texture;
    CHECK(texture.name() == 0);
    CHECK_FALSE(static_cast<bool>(texture));
}

TEST_CASE("handle: a moved-from handle is empty and frees nothing") {
    if (!test::have_context()) {
        return;
    }
    gl::Buffer a = gl::Buffer::create();
    CHECK(alive(a));
    const unsigned name = a.name();
    {
        const gl::Buffer b = std::move(a);
        CHECK(a.name() == 0); // NOLINT: tests the state after a move
        CHECK(b.name() == name);
        CHECK(glIsBuffer(name) == GL_TRUE);
    }
    CHECK(glIsBuffer(name) == GL_FALSE);
}

TEST_CASE("handle: assigning to a handle frees its old name") {
    if (!test::have_context()) {
        return;
    }
    gl::Buffer a = gl::Buffer::create();
    gl::Buffer b = gl::Buffer::create();
    CHECK(alive(a));
    CHECK(alive(b));
    const unsigned old = a.name();
    const unsigned kept = b.name();
    a = std::move(b);
    CHECK(glIsBuffer(old) == GL_FALSE);
    CHECK(a.name() == kept);
    gl::Buffer &self = a;
    a = std::move(self);
    CHECK(a.name() == kept);
    CHECK(glIsBuffer(kept) == GL_TRUE);
    const unsigned released = a.release();
    CHECK(a.name() == 0);
    glDeleteBuffers(1, &released);
}

TEST_CASE("framebuffer: a multisampled picture resolves into a texture") {
    if (!test::have_context()) {
        return;
    }
    const gl::Renderbuffer color = gl::make_renderbuffer(GL_RGBA16F, 8, 4, 4);
    const gl::Renderbuffer depth = gl::make_renderbuffer(GL_DEPTH24_STENCIL8, 8, 4, 4);
    const gl::Framebuffer drawn = gl::make_framebuffer(color, depth);
    const gl::Texture texture = gl::make_target(GL_RGBA16F, 8, 4);
    const gl::Framebuffer resolved = gl::make_framebuffer(texture, {});
    gl::bind_framebuffer(drawn.name(), 8, 4);
    glClearColor(2.0F, 0.25F, 0.5F, 1.0F);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    gl::blit_color(drawn.name(), 8, 4, resolved.name(), 8, 4);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved.name());
    float pixel[4] = {};
    glReadPixels(7, 3, 1, 1, GL_RGBA, GL_FLOAT, pixel);
    CHECK(pixel[0] == 2.0F); // above 1: the target holds floats
    CHECK(pixel[1] == 0.25F);
    test::throw_on_error();
}

TEST_CASE("framebuffer: multisampled depth resolves into a texture") {
    if (!test::have_context()) {
        return;
    }
    constexpr int side_px = 8;
    const gl::Renderbuffer color = gl::make_renderbuffer(GL_RGBA16F, side_px, side_px, 4);
    const gl::Renderbuffer depth = gl::make_renderbuffer(GL_DEPTH24_STENCIL8, side_px, side_px, 4);
    const gl::Framebuffer drawn = gl::make_framebuffer(color, depth);
    gl::bind_framebuffer(drawn.name(), side_px, side_px);
    glClearDepth(0.25);
    glClear(GL_DEPTH_BUFFER_BIT);
    glClearDepth(1.0);
    const gl::Texture resolved = gl::make_target(GL_DEPTH24_STENCIL8, side_px, side_px);
    const gl::Framebuffer target = gl::make_framebuffer({}, resolved);
    gl::blit_depth(drawn.name(), target.name(), side_px, side_px);
    std::vector<float> values(side_px * side_px);
    glBindTexture(GL_TEXTURE_2D, resolved.name());
    glGetTexImage(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT, GL_FLOAT, values.data());
    for (const float value : values) {
        CHECK(value == doctest::Approx(0.25F));
    }
    CHECK(glGetError() == GL_NO_ERROR);
}

TEST_CASE("framebuffer: invalid attachments are rejected") {
    if (!test::have_context()) {
        return;
    }
    const gl::Texture color = gl::make_target(GL_RGBA8, 4, 4);
    CHECK_THROWS_AS(gl::make_framebuffer({}, color), Error); // a colour texture as depth
    test::clear_errors();
}

TEST_CASE("program: a compile error names the file and the line, through includes") {
    if (!test::have_context()) {
        return;
    }
    const test::Folder folder;
    folder.write("a.vert", std::string(vertex_text));
    folder.write("lib/part.glsl",
                 std::string("float half_of(float x) { return x * 0.5; }\nfloat wrong = ;\n"));
    folder.write(
        "a.frag",
        std::string("#include \"lib/part.glsl\"\nout vec4 color;\nvoid main() { color = vec4(1.0); }\n"));
    const gl::ShaderLibrary library(folder.path());
    try {
        const gl::Program program(library, "a.vert", "a.frag");
        FAIL("compiled");
    } catch (const Error &error) {
        CHECK_MESSAGE(std::string(error.what()).find("lib/part.glsl") != std::string::npos, error.what());
    }
    test::clear_errors();
}

TEST_CASE("program: a FrameUniforms block that differs from the struct is rejected") {
    if (!test::have_context()) {
        return;
    }
    const test::Folder folder;
    folder.write("a.vert", "layout(std140) uniform FrameUniforms { mat4 view_projection; vec4 view; };\n" +
                               std::string(vertex_text));
    folder.write("a.frag", std::string("out vec4 color;\nvoid main() { color = vec4(1.0); }\n"));
    std::string text = "layout(std140) uniform FrameUniforms { mat4 view_projection; vec4 eye; };\n"
                       "layout(location = 0) in vec3 position;\n"
                       "void main() { gl_Position = view_projection * vec4(position + eye.xyz, 1.0); }\n";
    folder.write("b.vert", text);
    const gl::ShaderLibrary library(folder.path());
    CHECK_THROWS_AS(gl::Program(library, "b.vert", "a.frag"), Error);
}

TEST_CASE("program: a MaterialUniforms block that differs from the struct is rejected") {
    if (!test::have_context()) {
        return;
    }
    const test::Folder folder;
    folder.write("a.vert", vertex_text);
    folder.write(
        "a.frag",
        "layout(std140) uniform MaterialUniforms { vec4 base_color; float translucency; } material;\n"
        "out vec4 color;\nvoid main() { color = material.base_color * material.translucency; }\n");
    CHECK_THROWS_WITH_AS(
        gl::Program(gl::ShaderLibrary(folder.path()), "a.vert", "a.frag"),
        doctest::Contains("MaterialUniforms.emission_color lies at byte -1, the player writes it at 16"),
        Error);
}

TEST_CASE("program: a block with more members than the struct is rejected") {
    if (!test::have_context()) {
        return;
    }
    const gl::ShaderLibrary ours(gl::ShaderLibrary::find());
    for (const auto &[file, use, more] :
         {std::tuple("lib/frame.glsl", "fog", "19 members"),
          std::tuple("lib/material.glsl", "material.base_color", "21 members")}) {
        std::string block = ours.source(file).text;
        block.erase(0, block.find("layout(std140)"));
        block.insert(block.find('}'), "float more;");
        const test::Folder folder;
        folder.write("a.vert", vertex_text);
        folder.write("a.frag", block + "\nout vec4 color;\nvoid main() { color = " + use + "; }\n");
        CHECK_THROWS_WITH_AS(gl::Program(gl::ShaderLibrary(folder.path()), "a.vert", "a.frag"),
                             doctest::Contains(more), Error);
    }
    test::clear_errors();
}

TEST_CASE("program: a draw call with a uniform that nothing has set is refused by its name") {
    if (!test::have_context()) {
        return;
    }
    const test::Folder folder;
    folder.write("a.vert", vertex_text);
    folder.write("a.frag",
                 "uniform sampler2D u_map;\nuniform vec4 u_rows[2];\nuniform mat3 u_turn;\n"
                 "uniform int u_count;\nout vec4 color;\nvoid main() {\n"
                 "color = texture(u_map, u_turn[0].xy) + u_rows[u_count] + u_rows[1] * u_turn[2].x; }\n");
    const gl::Program program(gl::ShaderLibrary(folder.path()), "a.vert", "a.frag");
    const gl::Texture target = gl::make_target(GL_RGBA8, 4, 4);
    const gl::Framebuffer framebuffer = gl::make_framebuffer(target, {});
    const gl::VertexArray empty = gl::VertexArray::create();
    gl::bind_framebuffer(framebuffer.name(), 4, 4);
    glBindVertexArray(empty.name());
    program.use();
    std::vector<std::string> missing;
    for (int step = 0; step < 6; ++step) {
        try {
            gl::draw_vertices(GL_TRIANGLES, 3);
            break;
        } catch (const Error &error) {
            const std::string text = error.what();
            missing.push_back(text.substr(text.find("u_")));
            CHECK(text.starts_with("shader a.frag: nothing has set its uniform u_"));
        }
        const std::string &name = missing.back();
        if (name == "u_map") {
            program.set_unit("u_map", 0);
        } else if (name == "u_count") {
            gl::Program::set(program.location("u_count"), 0);
        } else if (name == "u_turn") {
            gl::Program::set(program.location("u_turn"), glm::mat3(0.0F));
        } else {
            gl::Program::set(program.location(name.c_str()), glm::vec4(0.0F));
        }
    }
    std::ranges::sort(missing);
    CHECK(missing == std::vector<std::string>{"u_count", "u_map", "u_rows[0]", "u_rows[1]", "u_turn"});
    glBindVertexArray(0);
    gl::bind_framebuffer(0, 4, 4);
    test::throw_on_error();
}

TEST_CASE("shaders: each include comes once, defines and dialect are in the preamble") {
    const test::Folder folder;
    folder.write("lib/a.glsl", std::string("const float A = 1.0;\n"));
    folder.write("lib/b.glsl", std::string("#include \"lib/a.glsl\"\n"));
    folder.write("x.frag",
                 std::string("#include \"lib/a.glsl\"\n  #include \"lib/b.glsl\"\nvoid main() {}\n"));
    const std::string_view defines[] = {"COUNT 4"};
    const std::string desktop = gl::ShaderLibrary(folder.path()).source("x.frag", defines).text;
    CHECK(desktop.starts_with("#version 330 core\n#define COUNT 4\n"));
    CHECK(desktop.find("const float A") == desktop.rfind("const float A"));
    const std::string web = gl::ShaderLibrary(folder.path(), gl::Dialect::es300).source("x.frag").text;
    CHECK(web.starts_with("#version 300 es\nprecision highp float;"));
}

TEST_CASE("shaders: missing files and includes outside the folder are rejected") {
    const test::Folder folder;
    folder.write("x.frag", std::string("#include \"../secret\"\n"));
    folder.write("y.frag", std::string("#include lib\n"));
    const gl::ShaderLibrary library(folder.path());
    CHECK_THROWS_AS(library.source("x.frag"), Error);
    CHECK_THROWS_AS(library.source("y.frag"), Error);
    CHECK_THROWS_AS(library.source("z.frag"), Error);
}

TEST_CASE("sampler: no mip coarser than max_level is sampled") {
    if (!test::have_context()) {
        return;
    }
    const auto coarsest = [](const gl::Sampler &sampler) {
        float level = 0.0F;
        glGetSamplerParameterfv(sampler.name(), GL_TEXTURE_MAX_LOD, &level);
        return level;
    };
    CHECK(coarsest(gl::make_sampler(gl::Wrap::clamp, gl::Filter::mipmapped, 1.0F, 3)) == 3.0F);
    CHECK(coarsest(gl::make_sampler(gl::Wrap::clamp, gl::Filter::mipmapped, 1.0F, 0)) == 0.0F);
    CHECK(coarsest(gl::make_sampler(gl::Wrap::clamp, gl::Filter::mipmapped)) >= 1000.0F);
}

TEST_CASE("pass meter: both clocks give each part its time, and nothing to parts that were not measured") {
    if (!test::have_context()) {
        return;
    }
    const gl::Texture color = gl::make_target(GL_RGBA8, 8, 8);
    const gl::Framebuffer framebuffer = gl::make_framebuffer(color, {});
    gl::bind_framebuffer(framebuffer.name(), 8, 8);
    for (const MeterClock clock : {MeterClock::processor, MeterClock::device}) {
        PassMeter meter(2, clock);
        meter.start();
        glClear(GL_COLOR_BUFFER_BIT);
        meter.stop(meter.clear());
        meter.stop(1);
        const std::vector<double> ms = meter.ms();
        REQUIRE(ms.size() == 5);
        CHECK(ms[meter.clear()] > 0.0);
        CHECK(ms[1] >= 0.0);
        CHECK(ms[0] == 0.0);
        CHECK(ms[meter.views()] == 0.0);
        CHECK(ms[meter.resolve()] == 0.0);
    }
}

TEST_CASE("gl: on a software rasteriser a texture takes the memory of one that was deleted") {
    if (!test::have_context() || !gl::software_renderer() || sanitizer_replaces_malloc) {
        return;
    }
    gl::keep_deleted_memory();
    const auto faults = [] { // pages that the system had to give
        rusage usage{};
        getrusage(RUSAGE_SELF, &usage);
        return usage.ru_minflt;
    };
    for (int i = 0; i < 3; ++i) { // larger than what malloc keeps by itself
        gl::Texture first = gl::make_target(GL_RGBA8, 2048, 1500);
        gl::Texture second = gl::make_target(GL_RGBA8, 2048, 1500);
    }
    const long before = faults();
    for (int i = 0; i < 3; ++i) {
        gl::Texture first = gl::make_target(GL_RGBA8, 2048, 1500);
        gl::Texture second = gl::make_target(GL_RGBA8, 2048, 1500);
    }
    CHECK(faults() - before < 15000); // of 18,000 pages; how many, other memory in the heap decides
    test::throw_on_error();
}

TEST_CASE("gl: depth tested late hides what lies behind, sample by sample, as depth tested early does") {
    if (!test::have_context()) {
        return;
    }
    const test::Folder folder;
    // A near triangle over half of the picture, then a far one over all of it.
    folder.write("a.vert",
                 "flat out float v_far;\nvoid main() { v_far = gl_VertexID < 3 ? 0.0 : 1.0;\n"
                 "vec2 p = vec2(gl_VertexID % 3 == 1 ? 3.0 : -1.0, gl_VertexID % 3 == 2 ? 3.0 : -1.0);\n"
                 "gl_Position = vec4(v_far > 0.5 ? p : p - vec2(1.1, 1.2), 0.5 * v_far, 1.0); }\n");
    folder.write("a.frag", "flat in float v_far;\nout vec4 color;\n"
                           "void main() { color = vec4(v_far, 1.0 - v_far, 0.0, 1.0); }\n");
    const gl::Program program(gl::ShaderLibrary(folder.path()), "a.vert", "a.frag");
    const gl::Renderbuffer color = gl::make_renderbuffer(GL_RGBA8, 8, 8, 4);
    const gl::Renderbuffer depth = gl::make_renderbuffer(GL_DEPTH24_STENCIL8, 8, 8, 4);
    const gl::Framebuffer samples = gl::make_framebuffer(color, depth);
    const gl::Texture target = gl::make_target(GL_RGBA8, 8, 8);
    const gl::Framebuffer resolved = gl::make_framebuffer(target, {});
    const gl::VertexArray empty = gl::VertexArray::create();
    const auto draw = [&](bool on) {
        gl::bind_framebuffer(samples.name(), 8, 8);
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        glBindVertexArray(empty.name());
        program.use();
        {
            const gl::LateDepthTest late(on);
            CHECK(glIsEnabled(GL_STENCIL_TEST) == (on ? GL_TRUE : GL_FALSE));
            gl::draw_vertices(GL_TRIANGLES, 6);
        }
        CHECK_FALSE(glIsEnabled(GL_STENCIL_TEST));
        CHECK_FALSE(glIsEnabled(GL_SAMPLE_ALPHA_TO_COVERAGE));
        gl::blit_color(samples.name(), 8, 8, resolved.name(), 8, 8);
        std::vector<unsigned char> pixels(8UL * 8 * 4);
        glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved.name());
        glReadPixels(0, 0, 8, 8, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
        return pixels;
    };
    glEnable(GL_DEPTH_TEST);
    const std::vector<unsigned char> early = draw(false);
    CHECK(early == draw(true));
    const auto has = [&](unsigned char red, unsigned char green) {
        for (std::size_t i = 0; i < early.size(); i += 4) {
            if (early[i] == red && early[i + 1] == green) {
                return true;
            }
        }
        return false;
    };
    CHECK(has(255, 0));                                                                       // the far one
    CHECK(has(0, 255));                                                                       // the near one
    CHECK((has(64, 191) || has(128, 128) || has(191, 64) || has(128, 127) || has(127, 128))); // their edge
    test::throw_on_error();
}
