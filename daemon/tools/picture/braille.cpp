#include "daemon/tools/picture/braille.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace posed::picture {
namespace {

constexpr int kDotsAcross = 2, kDotsDown = 4;  // of a character
constexpr int kHeadDots = 48;                  // of the circle that is the head
constexpr double kMaxLength = 1e4;             // dots of a stick; a longer one is no pose

// The bit of each dot in a braille pattern, row by row (Unicode, block U+2800).
constexpr std::array<std::array<std::uint8_t, kDotsAcross>, kDotsDown> kBit{
    {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}}};

class Dots {
 public:
  Dots(int columns, int rows)
      : columns_(columns),
        rows_(rows),
        patterns_(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {}

  [[nodiscard]] int across() const { return columns_ * kDotsAcross; }
  [[nodiscard]] int down() const { return rows_ * kDotsDown; }

  // Dots outside, and places that are not finite, are left out.
  void set(double x, double y) {
    if (!(x >= 0.0 && x < across() && y >= 0.0 && y < down())) return;
    const auto across_at = static_cast<int>(x);
    const auto down_at = static_cast<int>(y);
    const int cell = down_at / kDotsDown * columns_ + across_at / kDotsAcross;
    const std::size_t row = down_at % kDotsDown;
    patterns_[cell] |= kBit[row][across_at % kDotsAcross];
  }

  // A pattern is the three bytes of U+2800 and its dots.
  [[nodiscard]] std::string row(int row) const {
    std::string text;
    for (int column = 0; column < columns_; ++column) {
      const std::uint8_t dots =
          patterns_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                    static_cast<std::size_t>(column)];
      if (dots == 0) {
        text += ' ';
        continue;
      }
      text += '\xe2';
      text += static_cast<char>(0xa0 | (dots >> 6));
      text += static_cast<char>(0x80 | (dots & 0x3f));
    }
    return text;
  }

 private:
  int columns_, rows_;
  std::vector<std::uint8_t> patterns_;
};

}  // namespace

std::vector<std::string> braille(const Figure& figure, const Camera& camera,
                                 const StripLayout& room, int columns, int rows) {
  Dots dots(std::max(columns, 1), std::max(rows, 1));
  const double width_m = std::max(room.right_m - room.left_m, 1e-6);
  const double height_m = std::max(room.top_m - room.bottom_m, 1e-6);
  const double dots_per_m = std::min((dots.across() - 1) / width_m, (dots.down() - 1) / height_m);
  const double middle_m = (room.left_m + room.right_m) / 2.0;
  const Seen place = camera.see(figure.place_m);
  const auto draw = [&](double right_m, double up_m) {
    dots.set(dots.across() / 2.0 + (right_m - place.right_m - middle_m) * dots_per_m,
             dots.down() - 0.5 - (up_m - place.up_m - room.bottom_m) * dots_per_m);
  };
  for (const Stick& stick : figure.sticks) {
    const Seen from = camera.see(stick.from_m);
    const Seen to = camera.see(stick.to_m);
    const double length = std::hypot(to.right_m - from.right_m, to.up_m - from.up_m) * dots_per_m;
    if (!(length < kMaxLength)) continue;
    const int steps = static_cast<int>(std::ceil(length)) + 1;
    for (int i = 0; i <= steps; ++i) {
      const double part = static_cast<double>(i) / steps;
      draw(std::lerp(from.right_m, to.right_m, part), std::lerp(from.up_m, to.up_m, part));
    }
  }
  if (figure.head) {
    const Seen centre = camera.see(figure.head->centre_m);
    for (int i = 0; i < kHeadDots; ++i) {
      const double turn_rad = 2.0 * std::numbers::pi * i / kHeadDots;
      draw(centre.right_m + figure.head->radius_m * std::cos(turn_rad),
           centre.up_m + figure.head->radius_m * std::sin(turn_rad));
    }
  }
  std::vector<std::string> text;
  text.reserve(std::max(rows, 0));
  for (int row = 0; row < rows; ++row) text.push_back(dots.row(row));
  return text;
}

}  // namespace posed::picture
