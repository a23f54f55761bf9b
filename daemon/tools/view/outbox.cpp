#include "daemon/tools/view/outbox.hpp"

#include <utility>

namespace posed::view {

void Outbox::put_thinned(std::string_view topic, Bytes bytes) {
  Thinned& thinned = thinned_[topic];
  if (thinned.bytes) ++counts_.replaced;
  thinned.bytes = std::move(bytes);
}

void Outbox::put_newest(std::string_view topic, Bytes bytes) { newest_[topic] = std::move(bytes); }

void Outbox::put_event(Bytes bytes) {
  if (events_.size() == kMaxEvents) {
    events_.pop_front();
    ++counts_.dropped;
  }
  events_.push_back(std::move(bytes));
}

void Outbox::put_answer(Parcel parcel) {
  if (answers_.size() == kMaxAnswers) {
    answers_.pop_front();
    ++counts_.dropped;
  }
  answers_.push_back(std::move(parcel));
}

void Outbox::forget(std::string_view topic) {
  newest_.erase(topic);
  thinned_.erase(topic);
}

void Outbox::forget_all() {
  newest_.clear();
  thinned_.clear();
}

std::optional<Parcel> Outbox::next() {
  Parcel parcel;
  if (!answers_.empty()) {
    parcel = std::move(answers_.front());
    answers_.pop_front();
  } else if (!events_.empty()) {
    parcel.bytes = std::move(events_.front());
    events_.pop_front();
  } else if (!newest_.empty()) {
    parcel.bytes = std::move(newest_.begin()->second);
    newest_.erase(newest_.begin());
  } else {
    for (auto& [topic, thinned] : thinned_) {
      if (!thinned.bytes || thinned.sent_credit == credit_) continue;
      thinned.sent_credit = credit_;
      parcel.bytes = std::exchange(thinned.bytes, nullptr);
      break;
    }
  }
  if (!parcel.bytes) return std::nullopt;
  ++counts_.sent;
  return parcel;
}

}  // namespace posed::view
