// A growing array of plain values that is never filled with zeros and, once large, lies in huge pages: a
// file's elements are written once, and a page fault for every 4 KiB of them would cost as much as reading
// the text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <span>
#include <type_traits>
#include <utility>

namespace paradize::obj {

// Bytes of at least `wanted` that hold the first `used` of `old` (which is freed); `held` is how many there
// are. Throws std::bad_alloc.
void *grow_bytes(void *old, std::size_t used, std::size_t wanted, std::size_t &held);
void free_bytes(void *bytes, std::size_t held) noexcept;

template <typename T>
class Buffer {
    static_assert(std::is_trivially_copyable_v<T>);

  public:
    Buffer() = default;
    Buffer(const Buffer &) = delete;
    Buffer &operator=(const Buffer &) = delete;
    Buffer(Buffer &&other) noexcept { swap(other); }
    Buffer &operator=(Buffer &&other) noexcept {
        Buffer taken(std::move(other));
        swap(taken);
        return *this;
    }
    ~Buffer() { free_bytes(data_, held_); }

    std::size_t size() const { return size_; }
    bool empty() const { return size_ == 0; }
    T *data() { return data_; }
    const T *data() const { return data_; }
    T *begin() { return data_; }
    T *end() { return data_ + size_; }
    const T *begin() const { return data_; }
    const T *end() const { return data_ + size_; }
    T &operator[](std::size_t i) { return data_[i]; }
    const T &operator[](std::size_t i) const { return data_[i]; }
    T &back() { return data_[size_ - 1]; }

    void reserve(std::size_t count) {
        if (count * sizeof(T) > held_)
            data_ = static_cast<T *>(grow_bytes(data_, size_ * sizeof(T), count * sizeof(T), held_));
    }
    // Room for `more` values behind the last; they count only after `resize` or `push`.
    T *extend(std::size_t more) {
        if ((size_ + more) * sizeof(T) > held_)
            reserve(size_ + more > 2 * size_ ? size_ + more : 2 * size_);
        return data_ + size_;
    }
    // Elements beyond the old size are not initialised.
    void resize(std::size_t count) {
        reserve(count);
        size_ = count;
    }
    void assign(std::size_t count, const T &value) {
        size_ = 0;
        reserve(count);
        for (std::size_t i = 0; i < count; ++i)
            data_[i] = value;
        size_ = count;
    }
    void push_back(const T &value) {
        *extend(1) = value;
        ++size_;
    }
    void append(std::span<const T> values) {
        if (!values.empty())
            std::memcpy(static_cast<void *>(extend(values.size())), values.data(), values.size_bytes());
        size_ += values.size();
    }
    void append(std::initializer_list<T> values) {
        append(std::span<const T>(values.begin(), values.size()));
    }
    operator std::span<const T>() const { return {data_, size_}; }

  private:
    void swap(Buffer &other) noexcept {
        std::swap(data_, other.data_);
        std::swap(size_, other.size_);
        std::swap(held_, other.held_);
    }

    T *data_ = nullptr;
    std::size_t size_ = 0, held_ = 0; // held_: bytes
};

} // namespace paradize::obj
