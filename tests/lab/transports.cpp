#include "tests/lab/transports.hpp"

#include <poll.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "drivers/transport/hotplug_monitor.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "tests/lab/gadget.hpp"
#include "tests/lab/resources.hpp"

namespace posed::lab {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using drivers::Transport;

constexpr int kRounds = 10;
constexpr std::size_t kReport = 64;  // bytes: one packet of a full-speed device
constexpr std::size_t kReportsARound = 100;
constexpr auto kPeriod = 5ms;
constexpr auto kPatience =
    5s;  // timeout of the lab; measured times are printed and judged separately
constexpr auto kMaxReturn = 1s;

using Report = std::array<std::byte, kReport>;

// Report n: its number and bytes computed from it, so that a mixture of two reports is detected.
Report report_of(std::uint32_t n) {
  Report report{};
  for (std::size_t i = 0; i < 4; ++i) report[i] = static_cast<std::byte>(n >> (8 * i));
  std::uint32_t state = n * 2654435761U + 1;
  for (std::size_t i = 4; i < kReport; ++i) {
    state = state * 1664525U + 1013904223U;
    report[i] = static_cast<std::byte>(state >> 24);
  }
  return report;
}

std::uint32_t number_of(std::span<const std::byte> report) {
  std::uint32_t n = 0;
  for (std::size_t i = 0; i < 4; ++i) n |= std::to_integer<std::uint32_t>(report[i]) << (8 * i);
  return n;
}

// Counts what arrives: whole reports in order, and everything else.
class Judge {
 public:
  // A node or endpoint gives one report per read.
  void take_report(std::span<const std::byte> bytes) {
    if (bytes.size() != kReport || !std::ranges::equal(bytes, report_of(number_of(bytes)))) {
      ++wrong_;
      return;
    }
    count(number_of(bytes));
  }
  // A serial port gives bytes; the first report may be cut off by the opening.
  void take_bytes(std::span<const std::byte> bytes) {
    pending_.insert(pending_.end(), bytes.begin(), bytes.end());
    while (pending_.size() >= kReport) {
      const auto head = std::span(pending_).first(kReport);
      const bool whole = std::ranges::equal(head, report_of(number_of(head)));
      if (!whole && right_ > 0) ++wrong_;
      if (whole) count(number_of(head));
      pending_.erase(pending_.begin(), pending_.begin() + (whole ? kReport : 1));
    }
  }
  [[nodiscard]] std::size_t right() const { return right_; }
  [[nodiscard]] std::size_t wrong() const { return wrong_; }

 private:
  void count(std::uint32_t n) {
    if (right_ > 0 && n != last_ + 1) ++wrong_;
    last_ = n;
    ++right_;
  }

  std::vector<std::byte> pending_;
  std::size_t right_ = 0, wrong_ = 0;
  std::uint32_t last_ = 0;
};

struct Outcome {
  std::size_t right = 0, wrong = 0;
  Clock::duration enumerated{}, back{},
      lost{};  // time until the kernel lists it; until our first report; until its loss is noticed
  std::string problems;
};

// Opens a device that is just being plugged in as the daemon's supervisor does: it waits for a
// hotplug event or a short time.
Result<std::unique_ptr<Transport>> open_soon(const LabDevice& device,
                                             drivers::HotplugMonitor& arrivals) {
  const auto deadline = Clock::now() + kPatience;
  while (true) {
    auto transport = device.open();
    if (transport || Clock::now() > deadline) return transport;
    pollfd wanted{.fd = arrivals.poll_fd(), .events = POLLIN, .revents = 0};
    ::poll(&wanted, 1, 50);
    arrivals.consume();
  }
}

// Reads until `enough` returns true, the device is lost, or the timeout passes.
bool read_until(Transport& transport, Judge& judge, bool serial,
                const std::function<bool()>& enough) {
  const auto deadline = Clock::now() + kPatience;
  while (!enough() && Clock::now() < deadline) {
    pollfd wanted{.fd = transport.poll_fd(), .events = POLLIN, .revents = 0};
    ::poll(&wanted, 1, 100);
    while (true) {
      const drivers::Chunk chunk = transport.read(0);
      if (chunk.lost) return false;
      if (chunk.bytes.empty()) break;
      serial ? judge.take_bytes(chunk.bytes) : judge.take_report(chunk.bytes);
    }
  }
  return true;
}

Outcome one_round(LabDevice& device, drivers::HotplugMonitor& arrivals) {
  const auto plugged_at = Clock::now();
  device.plug();
  std::jthread feeder([&](const std::stop_token& stop) {
    for (std::uint32_t n = 1; !stop.stop_requested(); std::this_thread::sleep_for(kPeriod)) {
      if (device.say(report_of(n))) ++n;
    }
  });
  Outcome outcome;
  auto transport = open_soon(device, arrivals);
  const auto there_since = device.there_since();
  if (!transport) {
    outcome.problems = transport.error().message;
  } else if (!there_since) {
    outcome.problems = "what was opened has no node";
  } else if (auto ok = (*transport)->start(0); !ok) {
    outcome.problems = ok.error().message;
  }
  Judge judge;
  if (outcome.problems.empty()) {
    (void)read_until(**transport, judge, device.serial, [&] { return judge.right() > 0; });
    outcome.enumerated = *there_since - plugged_at;
    outcome.back = Clock::now() - *there_since;
    (void)read_until(**transport, judge, device.serial,
                     [&] { return judge.right() >= kReportsARound; });
  }
  const auto unplugged_at = Clock::now();
  device.unplug();  // while the feeder still sends
  if (outcome.problems.empty() &&
      read_until(**transport, judge, device.serial, [] { return false; })) {
    outcome.problems = "it is unplugged and nobody noticed";
  }
  outcome.lost = Clock::now() - unplugged_at;
  outcome.right = judge.right();
  outcome.wrong = judge.wrong();
  return outcome;
}

long ms(Clock::duration time) {
  return static_cast<long>(std::chrono::duration_cast<std::chrono::milliseconds>(time).count());
}

bool check(LabDevice& device) {
  drivers::HotplugMonitor arrivals;
  Outcome sum;
  Resources after_first, after_last;
  for (int round = 0; round < kRounds && sum.problems.empty(); ++round) {
    const Outcome outcome = one_round(device, arrivals);
    sum.right += outcome.right;
    sum.wrong += outcome.wrong;
    sum.enumerated = std::max(sum.enumerated, outcome.enumerated);
    sum.back = std::max(sum.back, outcome.back);
    sum.lost = std::max(sum.lost, outcome.lost);
    sum.problems = outcome.problems;
    if (outcome.right < kReportsARound && sum.problems.empty())
      sum.problems = "reports are missing";
    after_last = Resources::now();
    if (round == 0) after_first = after_last;
  }
  const bool lean = after_last.descriptors == after_first.descriptors &&
                    after_last.memory_kb <= after_first.memory_kb + kMemorySlack_kb;
  const bool good = sum.problems.empty() && sum.wrong == 0 && sum.back < kMaxReturn &&
                    sum.lost < kMaxReturn && lean;
  std::printf("%s transport %s: %d replugs, %zu reports right, %zu wrong or out of order",
              good ? "ok  " : "FAIL", device.name.c_str(), kRounds, sum.right, sum.wrong);
  std::printf(", found by the kernel within %ld ms, back %ld ms later, lost noticed within %ld ms",
              ms(sum.enumerated), ms(sum.back), ms(sum.lost));
  std::printf(", descriptors %ld -> %ld, memory %ld -> %ld KB%s%s\n", after_first.descriptors,
              after_last.descriptors, after_first.memory_kb, after_last.memory_kb,
              sum.problems.empty() ? "" : ": ", sum.problems.c_str());
  return good;
}

}  // namespace

int check_transports(const LabDevices& devices, std::string_view only) {
  int failed = 0;
  for (const auto& device : devices) {
    if (only.empty() || device->name == only) failed += check(*device) ? 0 : 1;
  }
  return failed;
}

}  // namespace posed::lab
