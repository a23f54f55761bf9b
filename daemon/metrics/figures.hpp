// Figures: everything that the metrics tell, of one moment. Plain values; who has them fills them.
// Cold.
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
  std::int64_t error_ns = kNoTime_ns;  // when the last of them was
};

// The connections of a socket.
struct SocketFigures {
  std::size_t peers = 0;   // now
  std::uint64_t cuts = 0;  // that posed has ended because of what they sent, or because of a limit
};

struct Figures {
  v1::Stats stats{};
  std::vector<publish::StreamFigures> streams{};
  SocketFigures publish{}, control{};
  control::ControlCounts requests{};
  std::optional<RecorderFigures> recorder{};  // empty: nothing is recorded
};

// All of them as Prometheus reads them, with what the system says of the process and of the
// recording's disk.
[[nodiscard]] std::string metrics_text(const Figures& figures);

}  // namespace posed::metrics
