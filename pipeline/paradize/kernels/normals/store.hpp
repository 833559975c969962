// Finished rows on their way out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "normals/types.hpp"

namespace paradize::normals {

// From so many bytes on a result does not stay in a cache anyway: it goes past them, which spares the read
// that a plain write makes of every line.
constexpr std::size_t stream_from = std::size_t{4} << 20;

// A row of normals is made in a small buffer of its own, with room for what whole vectors write beyond the
// end.
class RowStore {
  public:
    RowStore(std::size_t columns, std::size_t all_floats, const Kernels &kernels)
        : row_(3 * columns + slack / sizeof(float)), bytes_(3 * columns * sizeof(float)), kernels_(kernels),
          past_(all_floats * sizeof(float) >= stream_from) {}
    ~RowStore() {
        if (past_) {
            kernels_.fence();
        }
    }
    RowStore(const RowStore &) = delete;
    RowStore &operator=(const RowStore &) = delete;

    float *row() { return row_.data(); }

    void flush(float *to) {
        if (past_) {
            kernels_.stream(reinterpret_cast<std::uint8_t *>(to),
                            reinterpret_cast<const std::uint8_t *>(row_.data()), bytes_);
        } else {
            std::memcpy(to, row_.data(), bytes_);
        }
    }

  private:
    std::vector<float> row_;
    std::size_t bytes_;
    const Kernels &kernels_;
    bool past_;
};

} // namespace paradize::normals
