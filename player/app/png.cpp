#include "app/png.hpp"

#include "error.hpp"

#include <png.h>

#include <cstring>
#include <unistd.h>

namespace paradize {

void write_png(const std::filesystem::path &path, std::span<const std::uint8_t> pixels, int width_px,
               int height_px) {
    png_image image;
    std::memset(&image, 0, sizeof image);
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(width_px);
    image.height = static_cast<png_uint_32>(height_px);
    image.format = PNG_FORMAT_RGB;
    image.flags = PNG_IMAGE_FLAG_FAST; // four times as fast, files are 10 % larger
    std::error_code failure;
    if (path.has_parent_path()) {
        std::filesystem::create_directories(path.parent_path(), failure);
    }
    std::filesystem::path part = path;
    std::string hidden(1, '.');
    hidden += path.filename().string();
    hidden += '.';
    hidden += std::to_string(::getpid());
    part.replace_filename(hidden);
    if (png_image_write_to_file(&image, part.c_str(), 0, pixels.data(), 0, nullptr) == 0) {
        const std::string message = image.message;
        std::filesystem::remove(part, failure);
        throw Error(path.string() + ": cannot write: " + message);
    }
    std::filesystem::rename(part, path, failure);
    if (failure) {
        std::error_code ignored;
        std::filesystem::remove(part, ignored);
        throw Error(path.string() + ": cannot write: " + failure.message());
    }
}

} // namespace paradize
