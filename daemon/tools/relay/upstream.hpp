// Upstream: a relay's one connection to a daemon, or to another relay. It connects in the
// background and again whenever the connection is lost; libzmq then repeats the subscriptions. Only
// few messages wait, so what comes after a stall is new. One thread uses it. Cold.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "proto/frame/result.hpp"
#include "proto/zmq/link_monitor.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::relay {

struct UpstreamSettings {
  std::string endpoint;
  std::filesystem::path key{};         // the relay's own NAME.key; empty: no CURVE
  std::filesystem::path server_key{};  // the daemon's NAME.pub
};

class Upstream {
 public:
  // `context` outlives it.
  [[nodiscard]] static Result<Upstream> open(void* context, const UpstreamSettings& settings);

  [[nodiscard]] void* socket() const noexcept { return socket_.get(); }
  [[nodiscard]] void* news() const noexcept { return monitor_.socket(); }  // readable: take_news()
  [[nodiscard]] const std::string& endpoint() const noexcept { return settings_.endpoint; }

  // Returns false if the connection cannot take more subscriptions now.
  [[nodiscard]] bool subscribe(const std::string& prefix, bool on);

  // The next message, if one waits. `sound` is false for one that is not a topic and a body, which
  // is skipped.
  [[nodiscard]] bool receive(net::Message& topic, net::Message& body, bool& sound);

  // Takes what happened to the connection, and logs when it was made, lost or refused.
  void take_news();
  [[nodiscard]] bool established() const noexcept { return monitor_.established(); }

 private:
  Upstream(UpstreamSettings settings, net::Socket socket, net::LinkMonitor monitor)
      : settings_(std::move(settings)), socket_(std::move(socket)), monitor_(std::move(monitor)) {}

  UpstreamSettings settings_;
  net::Socket socket_;
  net::LinkMonitor monitor_;
};

}  // namespace posed::relay
