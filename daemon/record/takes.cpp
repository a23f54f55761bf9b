#include "daemon/record/takes.hpp"

#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/frame/time.hpp"

namespace posed::record {
namespace {

std::string with_remark(const std::string& sentence, const std::string& remark) {
  return remark.empty() ? sentence : sentence + "; " + remark;
}

}  // namespace

Result<pipeline::Take> Takes::mark(const pipeline::TakeMark& mark, std::uint64_t next_item) {
  const std::scoped_lock lock(mutex_);
  if (!mark.start && !running_) return fail("no take is running, so there is none to end");
  if (mark.start && last_number_ == kMaxTakes) {
    return fail("this recording has " + std::to_string(kMaxTakes) +
                " takes already; begin another recording");
  }
  std::optional<pipeline::Take> marked;
  if (running_) {
    marked = as_of_now();
    end(mark, next_item);
  }
  if (mark.start) {
    begin(mark, next_item);
    marked = as_of_now();
  }
  return *marked;
}

pipeline::Take Takes::as_of_now() const {
  pipeline::Take take = *running_;
  take.lost_chunks = state_.lost_chunks - lost_before_;
  take.trouble = state_.trouble;
  return take;
}

void Takes::end(const pipeline::TakeMark& mark, std::uint64_t next_item) {
  const pipeline::Take take = as_of_now();
  running_.reset();
  std::string sentence = fmt::format("{} has ended after {:.1f} s", pipeline::words_of(take),
                                     seconds(mark.time_ns - take.start_ns));
  if (take.lost_chunks > 0) {
    sentence += fmt::format("; meanwhile the log lost {} chunks", take.lost_chunks);
  }
  if (!mark.start) sentence = with_remark(sentence, mark.remark);
  changes_.push_back({.row = {.id = take.number,
                              .name = take.name,
                              .first_item = first_item_,
                              .last_item = next_item - 1,
                              .timecode = take.timecode},
                      .time_ns = mark.time_ns,
                      .text = std::move(sentence)});
}

void Takes::begin(const pipeline::TakeMark& mark, std::uint64_t next_item) {
  running_ = {.number = ++last_number_,
              .name = mark.name,
              .start_ns = mark.time_ns,
              .timecode = mark.timecode};
  first_item_ = next_item;
  lost_before_ = state_.lost_chunks;
  changes_.push_back({.row = {.id = last_number_,
                              .name = mark.name,
                              .first_item = next_item,
                              .last_item = log::kToTheEnd,
                              .timecode = mark.timecode},
                      .time_ns = mark.time_ns,
                      .text = with_remark(pipeline::words_of(*running_) + " begins", mark.remark)});
}

std::optional<pipeline::Take> Takes::running() const {
  const std::scoped_lock lock(mutex_);
  if (!running_) return std::nullopt;
  return as_of_now();
}

void Takes::set_state(RecorderState state) {
  const std::scoped_lock lock(mutex_);
  state_ = std::move(state);
}

RecorderState Takes::state() const {
  const std::scoped_lock lock(mutex_);
  return state_;
}

std::vector<TakeChange> Takes::next_changes() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(changes_, {});
}

}  // namespace posed::record
