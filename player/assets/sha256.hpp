#pragma once
// SHA-256 (FIPS 180-4) by Nettle, which uses the processor's SHA instructions.

#include <cstddef>
#include <memory>
#include <span>
#include <string>

struct sha256_ctx;

namespace paradize::assets {

class Sha256 {
  public:
    Sha256();
    ~Sha256();
    void add(std::span<const std::byte> bytes);
    /// Returns 64 hex digits of all bytes added so far, and starts a new hash.
    std::string hex();

  private:
    std::unique_ptr<sha256_ctx> state_;
};

} // namespace paradize::assets
