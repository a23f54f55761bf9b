// For the tests of outputs: streams that are handed over, and sockets that hear what is sent.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include "daemon/config/daemon_config.hpp"
#include "daemon/output/output.hpp"
#include "daemon/publish/publisher.hpp"
#include "daemon/system/clock.hpp"
#include "drivers/transport/udp.hpp"
#include "posed/v1/posed.pb.h"

namespace posed::output {

// A program that an output sends to.
class UdpReceiver {
 public:
  explicit UdpReceiver(const std::string& listen = "127.0.0.1:0")
      : transport_(drivers::UdpTransport::open({.sockets = {{.listen = listen}}}).value()) {}

  [[nodiscard]] std::string endpoint() const { return transport_->endpoint(0); }
  // The datagrams that have come since the last call. Waits until there were `all` since the first
  // one, because a busy kernel delivers them a little later; five seconds at most.
  [[nodiscard]] std::vector<std::vector<std::byte>> received(std::uint64_t all = 0) {
    std::vector<std::vector<std::byte>> datagrams;
    const std::int64_t until_ns = system::monotonic_ns() + 5 * kNanosPerSecond;
    while (true) {
      const drivers::Chunk chunk = transport_->read(0);
      if (!chunk.bytes.empty()) {
        datagrams.emplace_back(chunk.bytes.begin(), chunk.bytes.end());
        ++received_;
      } else if (received_ >= all || system::monotonic_ns() > until_ns) {
        return datagrams;
      }
    }
  }

 private:
  std::unique_ptr<drivers::UdpTransport> transport_;
  std::uint64_t received_ = 0;
};

inline publish::StreamInfo info_of(std::uint32_t id, const std::string& name,
                                   std::shared_ptr<const Skeleton> skeleton,
                                   drivers::SampleLayout samples = {}) {
  publish::StreamInfo info;
  info.stream = id;
  info.name = name;
  info.skeleton = std::move(skeleton);
  info.description.samples = std::move(samples);
  return info;
}

inline Frame frame_of(std::uint32_t stream, Frame frame) {
  frame.header.stream = stream;
  return frame;
}

// An output, and what it has told.
struct OutputRig {
  explicit OutputRig(config::OutputConfig config) {
    if (config.name.empty()) config.name = "test";
    auto opened = open_output(config);
    if (!opened) FAIL(opened.error().text());
    output = std::move(*opened);
    output->set_notify([this](std::optional<std::uint32_t> stream, const output::News& news) {
      reported.push_back((stream ? std::to_string(*stream) + ": " : "") + news.text +
                         (news.good ? " (good)" : ""));
    });
  }
  [[nodiscard]] v1::OutputStats stats() const {
    v1::OutputStats stats;
    output->fill(stats);
    return stats;
  }
  // The datagrams that each of its receivers has got, if none failed.
  [[nodiscard]] std::uint64_t sent() const { return stats().sent() / stats().receivers(); }
  // Hands over a frame and lets the output work.
  void pass(const Frame& frame, std::int64_t now_ns) const {
    output->frame(frame);
    static_cast<void>(output->turn(now_ns));
  }

  std::unique_ptr<Output> output;
  std::vector<std::string> reported;
};

}  // namespace posed::output
