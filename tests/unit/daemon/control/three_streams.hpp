// Streams that several tests control: two with a style, one without stages.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "daemon/control/request_handler.hpp"
#include "models/style/live/style_type.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::control {

inline std::vector<ControlledStream> three_streams() {
  const auto skeleton = std::make_shared<const Skeleton>(test::toy_skeleton());
  std::vector<ControlledStream> streams(3);
  streams[0].name = "walker";
  streams[0].publishes_raw = true;
  streams[0].skeleton = skeleton;
  streams[0].settings.stages.push_back(pipeline::stage_settings(style::style_type()));
  streams[0].models.resize(1);
  streams[1].name = "plain";
  streams[1].skeleton = skeleton;
  streams[2].name = "runner";
  streams[2].skeleton = skeleton;
  streams[2].settings.stages.push_back(pipeline::stage_settings(style::style_type()));
  streams[2].models.resize(1);
  return streams;
}

// A handler of these streams, which get ids from 0 on, and what it keeps for them.
struct HandlerRig {
  HandlerRig(std::vector<ControlledStream> streams, DaemonControl& daemon_control,
             ModelFolder models = {}, Clock clock = system::monotonic_ns,
             teach::Teacher* teacher = nullptr)
      : handler(daemon_control, kept, std::move(models), clock, teacher) {
    for (std::uint32_t i = 0; i < streams.size(); ++i) {
      streams[i].stream = streams[i].source_number = i;
      handler.add_stream(std::move(streams[i]));
    }
  }

  devices::KeptSettings kept;
  RequestHandler handler;
};

}  // namespace posed::control
