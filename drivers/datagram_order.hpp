// DatagramOrder: which datagrams of a numbered stream are new. A network delivers some late, some
// twice; a device that restarts begins its numbers again.
#pragma once

#include <cstdint>

#include "proto/frame/sink.hpp"

namespace posed::drivers {

class DatagramOrder {
 public:
  // Numbers count modulo 2^bits.
  explicit DatagramOrder(int bits) noexcept
      : mask_(bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1) {}

  // kOk: newer than all before it, or the device has restarted. kLate: a newer one came before it.
  // kDuplicate: it came before.
  RT_SAFE [[nodiscard]] Outcome accept(std::uint64_t number) noexcept {
    number &= mask_;
    const std::uint64_t behind = (newest_ - number) & mask_;
    if (!seen_any_ || (behind >= kWindow && !is_ahead(behind))) return begin_at(number);
    if (behind >= kWindow) {
      const std::uint64_t ahead = mask_ - behind + 1;
      seen_ = ahead >= kWindow ? 0 : seen_ << ahead;
      return keep(number);
    }
    // A device that restarts soon after its start repeats numbers of the window; the number of
    // some does not change at all.
    if (in_a_row_ >= kMaxInARow) return behind == 0 ? Outcome::kOk : begin_at(number);
    ++in_a_row_;
    const std::uint64_t bit = std::uint64_t{1} << behind;
    if ((seen_ & bit) != 0) return Outcome::kDuplicate;
    seen_ |= bit;
    return Outcome::kLate;
  }

 private:
  static constexpr std::uint64_t kWindow = 64;  // further behind than any network delivers
  static constexpr int kMaxInARow = 32;

  [[nodiscard]] bool is_ahead(std::uint64_t behind) const noexcept { return behind > mask_ / 2; }

  Outcome begin_at(std::uint64_t number) noexcept {
    seen_any_ = true;
    seen_ = 0;
    return keep(number);
  }
  Outcome keep(std::uint64_t number) noexcept {
    newest_ = number;
    seen_ |= 1;
    in_a_row_ = 0;
    return Outcome::kOk;
  }

  std::uint64_t mask_;
  std::uint64_t newest_ = 0;
  std::uint64_t seen_ = 0;  // bit i: the number `newest_ - i` came
  int in_a_row_ = 0;        // datagrams since the last new one
  bool seen_any_ = false;
};

}  // namespace posed::drivers
