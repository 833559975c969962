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

// A row is made in a small buffer of its own, with room for what whole vectors write beyond the end.
class RowStore {
  public:
    RowStore(std::size_t row_bytes, std::size_t all_bytes, const Kernels &kernels)
        : row_(row_bytes + slack), bytes_(row_bytes), kernels_(kernels), past_(all_bytes >= stream_from) {}
    ~RowStore() {
        if (past_) {
            kernels_.fence();
        }
    }
    RowStore(const RowStore &) = delete;
    RowStore &operator=(const RowStore &) = delete;

    std::uint8_t *row() { return row_.data(); }

    void flush(std::uint8_t *to) {
        if (past_) {
            kernels_.stream(to, row_.data(), bytes_);
        } else {
            std::memcpy(to, row_.data(), bytes_);
        }
    }

  private:
    std::vector<std::uint8_t> row_;
    std::size_t bytes_;
    const Kernels &kernels_;
    bool past_;
};

} // namespace paradize::normals
