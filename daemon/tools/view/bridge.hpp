// Bridge: what `posed view` runs. A thread of its own serves the page over HTTP, passes on what a
// daemon publishes to every open page at that page's pace, and the pages' requests to the daemon.
// For the daemon it is one client like any other. Cold.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "daemon/tools/view/daemon_link.hpp"
#include "proto/frame/result.hpp"

namespace posed::view {

inline constexpr std::uint16_t kUsualPort = 5580;

struct BridgeOptions {
  LinkOptions link{};
  std::filesystem::path page{};       // the folder with index.html
  std::string address = "127.0.0.1";  // where the page is served
  std::uint16_t port = kUsualPort;    // 0: any free one
  bool or_any_port = false;           // if the port is in use, any free one
};

// Whether an address is this machine's own, which no other machine reaches.
[[nodiscard]] Result<bool> is_loopback_address(const std::string& address);

class Bridge {
 public:
  // Reads the page, listens and connects in the background.
  [[nodiscard]] static Result<std::unique_ptr<Bridge>> start(const BridgeOptions& options);
  // Ends the thread; open pages see their connection end.
  ~Bridge();
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  // The page's address with the token that opens it. Any thread.
  [[nodiscard]] const std::string& url() const noexcept;
  [[nodiscard]] std::uint16_t port() const noexcept;

 private:
  class Parts;
  explicit Bridge(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace posed::view
