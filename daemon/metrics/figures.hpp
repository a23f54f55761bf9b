// Figures: all values of the metrics at one moment, which their owners fill in. Plain values. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/control/control_server.hpp"
#include "daemon/publish/stream_figures.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/time.hpp"

namespace posed::metrics {

// What the recorder counted.
struct RecorderFigures {
  std::filesystem::path file;
  std::uint64_t lost_chunks = 0, lost_frames = 0;
  std::uint64_t errors = 0;            // failed attempts to write
  std::int64_t error_ns = kNoTime_ns;  // when the last attempt failed
};

// The connections of a socket.
struct SocketFigures {
  std::size_t peers = 0;   // now
  std::uint64_t cuts = 0;  // connections that posed ended, because of their bytes or of a limit
};

struct Figures {
  v1::Stats stats{};
  std::vector<publish::StreamFigures> streams{};
  SocketFigures publish{}, control{};
  control::ControlCounts requests{};
  std::optional<RecorderFigures> recorder{};  // empty while nothing is recorded
};

// Writes all figures in the text format of Prometheus, with those that the system has of the
// process and of the recording's disk.
[[nodiscard]] std::string metrics_text(const Figures& figures);

}  // namespace posed::metrics
