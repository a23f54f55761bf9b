#include "daemon/tools/doctor/machine.hpp"

#include <grp.h>
#include <pwd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <fstream>

#include "drivers/known_usb.hpp"
#include "drivers/transport/address.hpp"
#include "drivers/transport/socket.hpp"

namespace posed::doctor {
namespace {

namespace fs = std::filesystem;

constexpr int kIpcLock = 14, kSysNice = 23;  // bits of the effective capabilities (capability.h)

std::uint64_t limit_of(__rlimit_resource resource) {
  rlimit limit{};
  if (::getrlimit(resource, &limit) != 0) return 0;
  return limit.rlim_cur == RLIM_INFINITY ? kNoLimit : limit.rlim_cur;
}

std::uint64_t effective_capabilities() {
  std::ifstream status("/proc/self/status");
  constexpr std::string_view kField = "CapEff:\t";
  for (std::string line; std::getline(status, line);) {
    if (!line.starts_with(kField)) continue;
    std::uint64_t bits = 0;
    std::from_chars(line.data() + kField.size(), line.data() + line.size(), bits, 16);
    return bits;
  }
  return 0;
}

std::string group_name(gid_t id) {
  const group* found = ::getgrgid(id);
  return found == nullptr ? "" : found->gr_name;
}

std::set<std::string> own_groups() {
  std::vector<gid_t> ids(std::max(::getgroups(0, nullptr), 0));
  const int count = ::getgroups(static_cast<int>(ids.size()), ids.data());
  ids.resize(std::max(count, 0));
  ids.push_back(::getegid());
  std::set<std::string> names;
  for (const gid_t id : ids) names.insert(group_name(id));
  names.erase("");
  return names;
}

std::string own_name() {
  const passwd* found = ::getpwuid(::geteuid());
  return found == nullptr ? std::to_string(::geteuid()) : found->pw_name;
}

std::vector<Node> glove_nodes() {
  std::vector<Node> nodes;
  const auto add = [&](drivers::DeviceInfo&& info) {
    struct stat node{};
    const bool known = ::stat(info.node.c_str(), &node) == 0 && node.st_gid != 0;
    nodes.push_back({.info = std::move(info), .group = known ? group_name(node.st_gid) : ""});
  };
  const auto is_glove = [](const drivers::DeviceInfo& info) {
    return std::ranges::any_of(drivers::known_usb(),
                               [&](const drivers::KnownUsb& known) { return known.fits(info); });
  };
  for (auto& port : drivers::list_serial_ports()) {
    if (port.is_usb) add(std::move(port));
  }
  for (auto* list : {&drivers::list_hid_nodes, &drivers::list_usb_devices}) {
    for (auto& one : list()) {
      if (is_glove(one)) add(std::move(one));
    }
  }
  return nodes;
}

ClockState clock_state() {
  timex state{};  // without modes it only reads
  const int answer = ::ntp_adjtime(&state);
  if (answer < 0) return ClockState::kUnknown;
  return answer == TIME_ERROR || (state.status & STA_UNSYNC) != 0 ? ClockState::kFree
                                                                  : ClockState::kSynchronised;
}

std::optional<std::uint64_t> free_bytes(const fs::path& folder) {
  std::error_code failed;
  const auto space = fs::space(folder, failed);
  if (failed) return std::nullopt;
  return space.available;
}

// Without listen(), so nobody can connect meanwhile.
Result<> try_bind(const Listener& listener) {
  const auto address = TRY(drivers::parse_endpoint(listener.endpoint));
  const int kind = listener.udp ? SOCK_DGRAM : SOCK_STREAM;
  // As the daemon does: TCP ports in TIME_WAIT, and multicast groups, are no conflict.
  const int fd = drivers::bind_socket(address, kind, !listener.udp || listener.shared);
  if (fd < 0) return fail(errno_text());
  ::close(fd);
  return {};
}

}  // namespace

Machine this_machine() {
  const std::uint64_t capabilities = effective_capabilities();
  const auto may = [&](int bit) { return (capabilities >> bit & 1U) != 0; };
  return {.user = own_name(),
          .groups = own_groups(),
          .nodes = glove_nodes(),
          .priority_limit = limit_of(RLIMIT_RTPRIO),
          .locked_limit_bytes = limit_of(RLIMIT_MEMLOCK),
          .may_schedule = may(kSysNice),
          .may_lock = may(kIpcLock),
          .clock = clock_state(),
          .free_bytes = free_bytes,
          .may_write = [](const fs::path& folder) { return ::access(folder.c_str(), W_OK) == 0; },
          .try_bind = try_bind};
}

std::string line_of(const Machine& machine, const fs::path& path) {
  std::ifstream file(machine.root / path);
  std::string line;
  std::getline(file, line);
  const auto first = line.find_first_not_of(" \t");
  if (first == std::string::npos) return {};
  return line.substr(first, line.find_last_not_of(" \t") - first + 1);
}

std::vector<fs::path> entries_of(const Machine& machine, const fs::path& path) {
  std::vector<fs::path> found;
  std::error_code failed;
  for (fs::directory_iterator entry(machine.root / path, failed), end; !failed && entry != end;
       entry.increment(failed)) {
    found.push_back(entry->path());
  }
  std::ranges::sort(found);
  return found;
}

}  // namespace posed::doctor
