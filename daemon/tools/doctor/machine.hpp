// Machine: all that the checks read of this computer, as values and functions, so that tests can
// show them another one. Cold.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "daemon/config/listeners.hpp"
#include "drivers/transport/enumerate.hpp"
#include "proto/frame/result.hpp"

namespace posed::doctor {

inline constexpr std::uint64_t kNoLimit = ~std::uint64_t{0};

// A device that may be a glove, or have one connected to it: a USB serial adapter, or the HID or
// USB device of a known glove.
struct Node {
  drivers::DeviceInfo info;
  std::string group{};  // that owns the node; empty: root's own, or unknown
};

using config::Listener;

enum class ClockState : std::uint8_t { kSynchronised, kFree, kUnknown };

struct Machine {
  std::filesystem::path root = "/";  // of proc, sys, etc and usr
  std::string user{};
  std::set<std::string> groups{};  // of this process
  std::vector<Node> nodes{};
  std::uint64_t priority_limit = 0;      // RLIMIT_RTPRIO
  std::uint64_t locked_limit_bytes = 0;  // RLIMIT_MEMLOCK; kNoLimit: none
  // What root, or a service with capabilities, may do whatever the limits say.
  bool may_schedule = false;  // CAP_SYS_NICE
  bool may_lock = false;      // CAP_IPC_LOCK
  ClockState clock = ClockState::kUnknown;
  // Free for this user on the disk of an existing folder; empty if it is unknown.
  std::function<std::optional<std::uint64_t>(const std::filesystem::path&)> free_bytes{};
  std::function<bool(const std::filesystem::path&)> may_write{};  // into an existing folder
  // Binds and closes a socket. The error says what the system said.
  std::function<Result<>(const Listener&)> try_bind{};
};

// This computer. Opens no device, but asks the system for all of the above.
[[nodiscard]] Machine this_machine();

// The first line of a file of `machine`, without blanks at its ends; empty if it cannot be read.
// `path` is relative to the root: "proc/sys/net/core/rmem_max".
[[nodiscard]] std::string line_of(const Machine& machine, const std::filesystem::path& path);

// The entries of a folder of `machine`, sorted; none if it is missing.
[[nodiscard]] std::vector<std::filesystem::path> entries_of(const Machine& machine,
                                                            const std::filesystem::path& path);

}  // namespace posed::doctor
