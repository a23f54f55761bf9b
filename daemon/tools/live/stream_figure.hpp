// StreamFigure: the pose of one stream of a daemon as a small figure of text, for `posed top`.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/tools/picture/camera.hpp"
#include "daemon/tools/picture/figure.hpp"
#include "daemon/tools/picture/strip.hpp"

namespace posed::tools {

class StreamFigure {
 public:
  explicit StreamFigure(std::string stream) : stream_(std::move(stream)) {}

  [[nodiscard]] const std::string& stream() const { return stream_; }

  // Takes a message of the daemon; those of other topics than skeleton/ and pose/ of the stream,
  // and what cannot be parsed, change nothing.
  void take(std::string_view topic, std::span<const std::byte> body);

  // The last pose, seen in three-quarter view as it stood when the first pose came; empty before.
  // Call it at the rate of the screen: what the poses need as room grows at once and shrinks
  // slowly.
  [[nodiscard]] std::vector<std::string> lines(int columns, int rows);

 private:
  void take_skeleton(std::span<const std::byte> body);
  void take_pose(std::span<const std::byte> body);
  void fit_room();

  std::string stream_;
  std::uint32_t wire_id_ = 0;  // of the skeleton, as frames carry it
  std::shared_ptr<const Skeleton> skeleton_{};
  std::unique_ptr<picture::FigureShape> shape_{};
  std::optional<picture::Camera> camera_{};
  std::optional<picture::Figure> figure_{};
  std::optional<picture::StripLayout> room_{};
};

}  // namespace posed::tools
