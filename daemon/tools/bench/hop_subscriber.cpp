#include "daemon/tools/bench/hop_subscriber.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>

#include "daemon/system/clock.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/time.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::tools {
namespace {

constexpr int kPoll_ms = 50;
constexpr std::size_t kReserved = 1 << 20;  // number of messages for which memory is reserved

// Runs in the child process.
class MessageRecord {
 public:
  MessageRecord() { received_.messages.reserve(kReserved); }

  // Receives one message if there is one.
  bool receive_one(void* socket) {
    net::Message topic;
    if (!topic.receive(socket)) return false;
    net::Message body;
    if (!body.receive(socket, 0)) return false;
    const std::int64_t came_ns = system::monotonic_ns();
    if (topic.text().starts_with("bare/")) {
      std::int64_t arrival_ns = 0;
      std::memcpy(&arrival_ns, body.bytes().data(), sizeof arrival_ns);
      received_.messages.push_back(
          {.arrival_ns = arrival_ns, .age_ns = came_ns - arrival_ns, .bare = true});
    } else if (frame_.ParseFromArray(body.bytes().data(), static_cast<int>(body.bytes().size()))) {
      // The last pose of a silent source is published again with its old times.
      if (frame_.quality() == v1::QUALITY_STALE) return true;
      const std::int64_t arrival_ns = frame_.arrival_ns();
      double stages_us = 0.0;
      for (const float stage_us : frame_.stage_us()) stages_us += static_cast<double>(stage_us);
      received_.messages.push_back({.arrival_ns = arrival_ns,
                                    .decoded_ns = frame_.decoded_ns() - arrival_ns,
                                    .stages_ns = nanoseconds(stages_us * 1e-6),
                                    .sent_ns = frame_.published_ns() - arrival_ns,
                                    .age_ns = came_ns - arrival_ns});
      std::uint64_t& last = last_[frame_.stream()];
      if (last != 0 && frame_.sequence() > last + 1) received_.gaps += frame_.sequence() - last - 1;
      last = frame_.sequence();
    }
    return true;
  }

  [[nodiscard]] const ReceivedMessages& received() const { return received_; }

 private:
  ReceivedMessages received_;
  v1::Frame frame_;
  std::map<std::string, std::uint64_t> last_;  // sequence by stream
};

int record_until_stopped(PipePair& parent) {
  auto context = net::open_context();
  if (!context) return 1;
  auto socket = net::open_socket(context->get(), ZMQ_SUB);
  if (!socket) return 1;
  for (const char* topic : {"pose/", "bare/"}) {
    if (!net::set_option(socket->get(), ZMQ_SUBSCRIBE, std::string_view(topic))) return 1;
  }
  for (std::string endpoint; !(endpoint = parent.read_line()).empty();) {
    if (!net::connect_socket(socket->get(), endpoint)) return 1;
  }
  MessageRecord record;
  std::array<zmq_pollitem_t, 2> wait{
      {{socket->get(), 0, ZMQ_POLLIN, 0}, {nullptr, parent.from(), ZMQ_POLLIN, 0}}};
  while ((wait[1].revents & (ZMQ_POLLIN | ZMQ_POLLERR)) == 0) {
    zmq_poll(wait.data(), static_cast<int>(wait.size()), kPoll_ms);
    while (record.receive_one(socket->get())) {
    }
  }
  const ReceivedMessages& received = record.received();
  const bool sent =
      parent.write(&received.gaps, sizeof received.gaps) &&
      parent.write(received.messages.data(), received.messages.size() * sizeof(Arrival));
  return sent ? 0 : 1;
}

}  // namespace

Result<std::unique_ptr<HopSubscriber>> HopSubscriber::fork(bool gives_way) {
  auto process = TRY(ChildProcess::fork(record_until_stopped, gives_way));
  return std::unique_ptr<HopSubscriber>(new HopSubscriber(std::move(process)));
}

void HopSubscriber::begin(const std::vector<std::string>& endpoints) {
  for (const std::string& endpoint : endpoints) process_.pipes().write_line(endpoint);
  process_.pipes().write_line("");
}

Result<ReceivedMessages> HopSubscriber::finish() {
  process_.pipes().close_to();
  ReceivedMessages received;
  if (!process_.pipes().read(&received.gaps, sizeof received.gaps)) {
    return fail("the subscriber's process ended early");
  }
  for (Arrival arrival; process_.pipes().read(&arrival, sizeof arrival);) {
    received.messages.push_back(arrival);
  }
  return received;
}

namespace {

using Ages = std::vector<double>;  // us

double quantile(const Ages& sorted, double p) {
  if (sorted.empty()) return 0.0;
  const auto last = static_cast<double>(sorted.size() - 1);
  return sorted[static_cast<std::size_t>(std::lround(p * last))];
}

double median(Ages values) {
  std::ranges::sort(values);
  return quantile(values, 0.5);
}

}  // namespace

HopFigures figures_of(Ages ages_us) {
  std::ranges::sort(ages_us);
  return {quantile(ages_us, 0.5), quantile(ages_us, 0.99), quantile(ages_us, 0.999),
          ages_us.empty() ? 0.0 : ages_us.back(), ages_us.size()};
}

HopReport report_hops(std::span<const Arrival> arrivals, std::int64_t start_ns,
                      std::int64_t end_ns) {
  std::map<std::int64_t, std::array<Ages, 2>> pairs;  // pipeline, bare
  std::array<Ages, 2> all;
  for (const Arrival& arrival : arrivals) {
    const std::int64_t pair = (arrival.arrival_ns - start_ns) / (2 * kNanosPerSecond);
    if (pair < 1 || arrival.arrival_ns >= end_ns) continue;
    const double age_us = static_cast<double>(arrival.age_ns) * 1e-3;
    pairs[pair][arrival.bare ? 1 : 0].push_back(age_us);
    all[arrival.bare ? 1 : 0].push_back(age_us);
  }
  Ages p50_ratios;
  Ages p99_ratios;
  for (const auto& [pair, ages] : pairs) {
    if (ages[0].empty() || ages[1].empty()) continue;
    const HopFigures pipeline = figures_of(ages[0]);
    const HopFigures bare = figures_of(ages[1]);
    p50_ratios.push_back(pipeline.p50_us / bare.p50_us);
    p99_ratios.push_back(pipeline.p99_us / bare.p99_us);
  }
  return {figures_of(all[1]), figures_of(all[0]), median(p50_ratios), median(p99_ratios)};
}

}  // namespace posed::tools
