#include "assets/sha256.hpp"

#include <array>
#include <cstdint>
#include <nettle/sha2.h>

namespace paradize::assets {

Sha256::Sha256() : state_(std::make_unique<sha256_ctx>()) {
    ::sha256_init(state_.get());
}

Sha256::~Sha256() = default;

void Sha256::add(std::span<const std::byte> bytes) {
    ::sha256_update(state_.get(), bytes.size(), reinterpret_cast<const std::uint8_t *>(bytes.data()));
}

std::string Sha256::hex() {
    std::array<std::uint8_t, SHA256_DIGEST_SIZE> digest{};
    ::sha256_digest(state_.get(), digest.size(), digest.data());
    std::string out;
    for (const unsigned byte : digest) {
        out += "0123456789abcdef"[byte >> 4U];
        out += "0123456789abcdef"[byte & 15U];
    }
    return out;
}

} // namespace paradize::assets
