// The publisher's functions for other threads, and what its own thread does about them.
#include "daemon/publish/publisher_requests.hpp"

#include <algorithm>
#include <utility>

#include "daemon/net/peer_guard.hpp"
#include "daemon/net/zap_authenticator.hpp"
#include "daemon/publish/frame_output.hpp"
#include "daemon/publish/published_slots.hpp"
#include "proto/text/clean.hpp"

namespace posed::publish {

template <typename Change>
void Publisher::ask(Change&& change) {
  {
    const std::scoped_lock lock(requests_->mutex);
    change(requests_->batch);
  }
  requests_->asked.store(true);
  wake_.notify();
}

void Publisher::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  wake_.notify();
}

void Publisher::add(StreamInfo stream) {
  slots_->add(std::make_unique<PublishedStream>(std::move(stream)));
  requests_->asked.store(true);
  wake_.notify();
}

void Publisher::remove(std::uint32_t stream) {
  std::unique_lock lock(requests_->mutex);
  if (!requests_->served) {
    slots_->take_additions();
    take_all();
    return remove_now(stream);
  }
  requests_->batch.leaving.push_back(stream);
  const std::uint64_t mine = ++requests_->removals;
  requests_->asked.store(true);
  wake_.notify();
  requests_->done.wait(lock, [&] { return requests_->removals_done >= mine; });
}

void Publisher::set_stages(std::uint32_t stream, std::vector<StageInfo> stages) {
  slots_->set_stages(stream, std::move(stages));
}

void Publisher::post_event(std::uint32_t stream, v1::Event::Kind kind, std::string text) {
  ask([&](Requests::Batch& batch) { batch.events.push_back({stream, kind, std::move(text)}); });
}

void Publisher::check_subscribers() {
  ask([](Requests::Batch& batch) { batch.check = true; });
}

v1::Stats Publisher::stats() const {
  v1::Stats stats;
  {
    const std::scoped_lock lock(requests_->mutex);
    stats = requests_->stats;
  }
  slots_->fill(stats);
  stats.set_time_ns(options_.data_clock());
  add_sources(stats);
  add_outputs(stats);
  if (options_.more_stats) options_.more_stats(stats);
  return stats;
}

std::vector<StreamFigures> Publisher::figures() const { return slots_->figures(); }

void Publisher::add_sources(v1::Stats& stats) const {
  for (const SourceInfo& info : options_.sources) {
    v1::SourceStats& source = *stats.add_source();
    source.set_name(info.name);
    source.set_driver(info.driver);
    source.set_identity(clean(info.present->description()->identity));
    source.set_away(is_away(*info.counters, info.comes_and_goes));
    source.set_connections(info.counters->connections.load());
    for (const auto& outcome : info.counters->outcome) source.add_outcome(outcome.load());
    source.set_kernel_dropped(info.counters->kernel_dropped.load());
    const auto of_source = [&](const v1::StreamStats& stream) {
      return stream.source_name() == info.name;
    };
    source.set_streams(
        static_cast<std::uint32_t>(std::ranges::count_if(stats.stream(), of_source)));
  }
}

void Publisher::add_outputs(v1::Stats& stats) const {
  for (const FrameOutput* const output : options_.outputs) output->fill(*stats.add_output());
}

bool Publisher::asked() const noexcept { return requests_->asked.load(); }

void Publisher::do_what_was_asked() {
  if (!requests_->asked.exchange(false)) return;
  Requests::Batch batch;
  {
    const std::scoped_lock lock(requests_->mutex);
    std::swap(batch, requests_->batch);
  }
  slots_->take_additions();
  announce_new();
  for (const Requests::Posted& event : batch.events) {
    PublishedStream* const published = slots_->find(event.stream);
    if (published == nullptr) continue;  // it has left
    send_event(*published, event.kind, options_.data_clock(), 0, event.text);
  }
  if (!batch.leaving.empty()) {
    take_all();  // items that came after this turn's first look, but before the removal
    for (const std::uint32_t stream : batch.leaving) remove_now(stream);
    const std::scoped_lock lock(requests_->mutex);
    requests_->removals_done += batch.leaving.size();
    requests_->done.notify_all();
  }
  if (!batch.check || options_.authenticator == nullptr) return;
  socket_.guard().cut_unless([this](std::string_view user) {
    return options_.authenticator->allows(user, net::Domain::kPublish);
  });
}

void Publisher::remove_now(std::uint32_t stream) {
  if (PublishedStream* const published = slots_->find(stream)) {
    report_shed(*published, true);
    published->leave_outputs();
  }
  slots_->remove(stream);
}

void Publisher::begin_serving() {
  const std::scoped_lock lock(requests_->mutex);
  requests_->served = true;
}

// Nobody may wait for this thread after it.
void Publisher::end_serving() {
  while (true) {
    do_what_was_asked();
    const std::scoped_lock lock(requests_->mutex);
    requests_->served = !requests_->batch.leaving.empty();
    if (!requests_->served) return;
  }
}

void Publisher::keep_stats(v1::Stats stats) {
  const std::scoped_lock lock(requests_->mutex);
  requests_->stats = std::move(stats);
}

}  // namespace posed::publish
