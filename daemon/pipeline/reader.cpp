#include "daemon/pipeline/reader.hpp"

#include <algorithm>
#include <utility>

#include "daemon/pipeline/reader_source.hpp"
#include "daemon/system/hot_mark.hpp"

namespace posed::pipeline {
namespace {

// Pause before another look at a lossless source, or at a command that waits for space in the ring.
constexpr std::int64_t kLookAgain_ns = 250'000;

}  // namespace

Result<std::unique_ptr<Reader>> Reader::open(const ReaderPorts& ports) {
  auto wake = system::EventFd::open();
  if (!wake) return std::unexpected(wake.error());
  auto poller = system::Poller::open();
  if (!poller) return std::unexpected(poller.error());
  if (auto added = (*poller)->add(**wake); !added) return std::unexpected(added.error());
  return std::unique_ptr<Reader>(new Reader(ports, std::move(*wake), std::move(*poller)));
}

Reader::Reader(const ReaderPorts& ports, std::unique_ptr<system::EventFd> wake,
               std::unique_ptr<system::Poller> poller)
    : ports_(ports), wake_(std::move(wake)), poller_(std::move(poller)) {}

Reader::~Reader() = default;

void Reader::add(const ReadSource& source) {
  const auto index = static_cast<std::uint32_t>(sources_.size());
  sources_.push_back(std::make_unique<Source>(index, source, ports_, *poller_, next_item_));
}

void Reader::begin() noexcept {
  for (const auto& source : sources_) source->begin();
}

std::int64_t Reader::turn(std::int64_t now_ns) noexcept {
  const bool all_taken = take_requests();
  for (const std::uint32_t source : std::exchange(ready_, {})) {
    handled_ += sources_[source]->serve();
  }
  const std::int64_t due_ns = serve_timed(now_ns);
  return all_taken ? due_ns : std::min(due_ns, now_ns + kLookAgain_ns);
}

void Reader::run() noexcept {
  const system::HotSection hot;
  begin();
  while (!stop_.load(std::memory_order_acquire)) {
    pulse_.beat();
    const std::int64_t now_ns = ports_.clock();
    const std::int64_t due_ns = turn(now_ns);
    system::rest(moderation_.rest_ns(handled_, now_ns));
    wake_->going_to_sleep();
    if (stop_.load(std::memory_order_acquire)) break;
    ready_ = poller_->wait(called() ? 0 : system::time_left_ns(due_ns, ports_.clock));
    wake_->awake();
  }
}

void Reader::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  wake_->notify();
}

void Reader::call() noexcept {
  called_.store(true, std::memory_order_release);
  wake_->notify();
}

// A calibration is acknowledged by an event, and a body that leaves is reported by one; events need
// a free slot in the ring: while there is none, the requests wait.
bool Reader::take_requests() noexcept {
  if (!called_.exchange(false, std::memory_order_acq_rel) && !requests_wait_) return true;
  requests_wait_ = false;
  for (const auto& source : sources_) requests_wait_ |= !source->exchange();
  const auto apply = [this](const DeviceCommand& command) noexcept {
    Source& source = *sources_[command.stream];
    if (command.kind == DeviceCommand::Kind::kCalibrate) {
      source.calibrate(command);
    } else {
      source.send(std::span(command.bytes).first(command.size));
    }
  };
  if (ports_.commands != nullptr) {
    while (ports_.out->has_room() && ports_.commands->consume(apply)) {
    }
    requests_wait_ |= !ports_.commands->empty();
  }
  return !requests_wait_;
}

std::int64_t Reader::serve_timed(std::int64_t now_ns) noexcept {
  std::int64_t next_ns = system::kForever_ns;
  for (const auto& source : sources_) {
    std::int64_t due_ns = source->due_ns();
    if (due_ns == kNoTime_ns) continue;
    if (due_ns <= now_ns) {
      handled_ += source->serve();
      due_ns = source->due_ns();
      if (due_ns == kNoTime_ns) continue;
      if (source->must_wait()) due_ns = std::max(due_ns, now_ns + kLookAgain_ns);
    }
    next_ns = std::min(next_ns, due_ns);
  }
  return next_ns;
}

}  // namespace posed::pipeline
