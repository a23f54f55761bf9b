#include "tests/lab/speaker.hpp"

#include <span>
#include <utility>

namespace posed::lab {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::byte>;

constexpr auto kPeriod = 20ms;  // between a glove's reports

Bytes ultra_usb(std::uint32_t value) {
  Bytes report(64);
  for (std::size_t i = 0; i < 14; ++i) {
    report[2 * i] = static_cast<std::byte>(value >> 8);
    report[2 * i + 1] = static_cast<std::byte>(value);
  }
  return report;
}

Bytes alpha_line(std::uint32_t value) {
  const std::string n = std::to_string(value);
  const std::string text = "A" + n + "B" + n + "C" + n + "D" + n + "E" + n + "\n";
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

// Report 1, five bends of six bits, no button, no LED in sight.
Bytes p5_report(std::uint32_t value) {
  Bytes report(24);
  report[0] = std::byte{1};
  for (std::size_t finger = 0; finger < 5; ++finger) {
    for (std::size_t bit = 0; bit < 6; ++bit) {
      const std::size_t at = 8 + 6 * finger + bit;
      if ((value >> (5 - bit) & 1) != 0) report[at / 8] |= std::byte{0x80} >> (at % 8);
    }
  }
  report[5] |= std::byte{0x0F};
  report[6] |= std::byte{0xFF};
  report[7] |= std::byte{0xF0};
  return report;
}

}  // namespace

std::vector<Glove> gloves() {
  return {{.device = "hidraw",
           .driver = "fivedt",
           .config = "id = \"HID-1\"\n[stream.fivedt]\nmodel = \"ultra-usb-14\"\n",
           .modulus = 4000,
           .report = ultra_usb},
          {.device = "libusb", .driver = "p5", .config = "", .modulus = 64, .report = p5_report},
          {.device = "ttyacm",
           .driver = "lucidgloves",
           .config = "id = \"ACM-1\"\n",
           .modulus = 4096,
           .report = alpha_line}};
}

Speaker::Speaker(LabDevice& device, Glove glove)
    : device_(device),
      glove_(std::move(glove)),
      thread_([this](const std::stop_token& stop) { speak(stop); }) {}

std::vector<Moment> Speaker::said() const {
  const std::lock_guard lock(mutex_);
  return said_;
}

void Speaker::speak(const std::stop_token& stop) {
  for (std::uint32_t n = 1; !stop.stop_requested(); std::this_thread::sleep_for(kPeriod)) {
    const Moment offered = std::chrono::steady_clock::now();
    if (!device_.say(glove_.report(n % glove_.modulus))) continue;
    const std::lock_guard lock(mutex_);
    said_.push_back(offered);
    ++n;
  }
}

}  // namespace posed::lab
