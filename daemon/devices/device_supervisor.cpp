#include "daemon/devices/device_supervisor.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <numeric>
#include <string_view>

#include <poll.h>
#include <unistd.h>

#include <spdlog/spdlog.h>

#include "daemon/devices/calibration.hpp"
#include "daemon/system/realtime.hpp"

namespace posed::devices {
namespace {

// at most 0.5 s between tries, including the try itself
constexpr std::chrono::milliseconds kTryEvery{400};
// how often silence is checked while a device is connected
constexpr std::chrono::milliseconds kLookEvery{200};
// A device node that has just appeared may not open yet, because the kernel is still finding the
// device's interfaces or udev has not set the node's permissions.
constexpr std::chrono::milliseconds kTrySoon{50};
constexpr std::chrono::nanoseconds kSettles = std::chrono::seconds(1);

// [Outcome] what most packets were, or all of those that gave nothing; then: there were none.
constexpr std::array<std::string_view, kOutcomes + 1> kUseless{
    "packets come, but none has given a stream a pose for 3 s: see whether the sender streams "
    "bodies, and whether [[stream]] names one of them",
    "most packets of 3 s were cut or longer than they say: the sender may speak another version of "
    "its protocol",
    "most packets of 3 s had a wrong checksum: see to the cable and the baud rate",
    "most packets of 3 s had what cannot be: no number, no rotation, a body or bone that is not "
    "described, or another version's fields",
    "most packets of 3 s were another program's, or of a body that is not described or not loaded",
    "most packets of 3 s were overtaken by newer ones: the sender's clock or count goes back",
    "most packets of 3 s came twice: the sender repeats itself, as while it is paused",
    "nothing has answered for 3 s: see to the device, its address and the firewall"};

}  // namespace

UseWatch::Counts UseWatch::counts_of(const pipeline::SourceCounters& counters) {
  Counts counts{};
  for (std::size_t i = 0; i < counts.size(); ++i) counts[i] = counters.outcome[i].load();
  return counts;
}

void UseWatch::restart(const pipeline::SourceCounters& counters, std::int64_t now_ns) {
  *this = UseWatch();
  before_ = counts_of(counters);
  opened_ns_ = since_ns_ = now_ns;
}

std::size_t UseWatch::cause_of(const Counts& came, bool asks, bool used) {
  const std::uint64_t all = std::accumulate(came.begin(), came.end(), std::uint64_t{0});
  if (all == 0) return asks && !used ? kNoAnswer : kNone;
  const auto most = static_cast<std::size_t>(std::ranges::max_element(came) - came.begin());
  const auto outcome = static_cast<Outcome>(most);
  // Senders may add much that posed does not read.
  const bool harmless = outcome == Outcome::kOk || outcome == Outcome::kForeign ||
                        outcome == Outcome::kLate || outcome == Outcome::kDuplicate;
  if (!used) return most;
  return !harmless && 2 * came[most] > all ? most : kNone;
}

std::string UseWatch::look(const pipeline::SourceCounters& counters, bool asks,
                           std::int64_t now_ns) {
  const Counts counts = counts_of(counters);
  // The three seconds begin with the first packet, or with the question.
  if (!packets_came_) {
    packets_came_ = counts != before_;
    if (packets_came_ || !asks) since_ns_ = now_ns;
  }
  if (now_ns - since_ns_ < kEvery_ns) return {};
  Counts came{};
  for (std::size_t i = 0; i < came.size(); ++i) came[i] = counts[i] - before_[i];
  before_ = counts;
  const std::int64_t used_ns = counters.used_ns.load();
  used_ = used_ || (used_ns != kNoTime_ns && used_ns >= opened_ns_);
  since_ns_ = now_ns;
  const std::size_t cause = cause_of(came, asks, used_);
  if (cause == kNone || told_[cause]) return {};
  told_.set(cause);
  return std::string(kUseless[cause]);
}

bool DeviceSupervisor::wanted(const OpenSource& source) { return source.driver->expect != nullptr; }

DeviceSupervisor::DeviceSupervisor(OpenSource& source, SupervisorPorts ports)
    : source_(source),
      ports_(std::move(ports)),
      driver_(*source.driver),
      thread_([this] { run(); }) {}

DeviceSupervisor::~DeviceSupervisor() {
  stop();
  thread_.join();
}

void DeviceSupervisor::stop() noexcept {
  stop_.store(true);
  source_.ports->cancel();
  source_.slot->supervisor->notify();
}

void DeviceSupervisor::run() {
  system::name_thread("dev-" + source_.config.name);
  while (!stop_.load()) {
    while (source_.slot->out.consume([this](drivers::Device* /*device_*/) { take_back(); })) {
    }
    if (away_) {
      look_for_device();
    } else {
      write_to_device();
      keep_up();
      watch_use();
      watch_silence();
    }
    sleep();
  }
}

void DeviceSupervisor::keep_up() {
  if (upkeep_ == nullptr) return;
  upkeep_->upkeep(ports_.clock());
  if (const std::string note = upkeep_->consume_note(); !note.empty()) {
    ports_.report(v1::Event::KIND_WARNING, note);
  }
}

void DeviceSupervisor::sleep() {
  system::EventFd& wake = *source_.slot->supervisor;
  wake.going_to_sleep();
  if (source_.slot->out.empty() && !stop_.load()) {
    // When a device node appears it is tried at once. Where node events are not available, it is
    // tried at the next turn.
    const auto turn = !away_ ? kLookEvery : settling() ? kTrySoon : kTryEvery;
    std::array<pollfd, 3> wait{{{wake.fd(), POLLIN, 0},
                                {away_ ? hotplug_.poll_fd() : -1, POLLIN, 0},
                                {writer_ != nullptr ? writer_->waiting_fd() : -1, POLLIN, 0}}};
    poll(wait.data(), wait.size(), static_cast<int>(turn.count()));
    if ((wait[0].revents & POLLIN) != 0) {
      std::uint64_t rung = 0;
      [[maybe_unused]] const ssize_t cleared = ::read(wake.fd(), &rung, sizeof rung);
    }
    if ((wait[1].revents & POLLIN) != 0 && hotplug_.consume()) {
      settled_ns_ = ports_.clock() + kSettles.count();
    }
  }
  wake.awake();
}

bool DeviceSupervisor::settling() const { return ports_.clock() < settled_ns_; }

// Closes the link; only then can the port be opened again.
void DeviceSupervisor::take_back() {
  const std::string note = upkeep_ == nullptr ? "" : upkeep_->consume_note();
  writer_ = nullptr;
  upkeep_ = nullptr;
  device_.reset();
  away_ = true;
  source_.present->gone();
  const std::string why = std::exchange(asked_back_, false)
                              ? "nothing usable came from the device for a while"
                          : note.empty() ? "the link to the device is lost"
                                         : note;
  ports_.report(v1::Event::KIND_LOST, why + "; posed looks for it until it is back");
  reported_.clear();
}

void DeviceSupervisor::watch_use() {
  if (driver_.often_empty) return;
  const bool asks = device_->poll.period_ns != 0;
  const std::string text = use_.look(source_.counters, asks, ports_.clock());
  if (!text.empty()) ports_.report(v1::Event::KIND_WARNING, text);
}

void DeviceSupervisor::watch_silence() {
  if (device_->reopen_after_s <= 0.0 || asked_back_) return;
  const pipeline::SourceCounters& counters = source_.counters;
  if (!counters.connected.load()) return;
  const std::int64_t silent_ns = ports_.clock() - counters.received_ns.load();
  if (seconds(silent_ns) < device_->reopen_after_s) return;
  asked_back_ = true;
  source_.slot->give_back.store(true);
  ports_.reader->call();
}

// While a write is slow, the queue behind it drops old messages; this is reported.
void DeviceSupervisor::write_to_device() {
  if (writer_ == nullptr) return;
  writer_->write_waiting();
  const std::uint64_t dropped = writer_->dropped();
  if (dropped == drops_reported_) return;
  ports_.report(v1::Event::KIND_WARNING,
                std::to_string(dropped - std::exchange(drops_reported_, dropped)) +
                    " messages to the device were given up: it takes them too slowly; send fewer");
}

void DeviceSupervisor::look_for_device() {
  auto found = try_open();
  if (stop_.load()) return;
  if (!found) {
    const std::string text = found.error().text();
    if (text == reported_ || settling())
      return;  // reported before, or the device is only just starting
    reported_ = text;
    ports_.report(v1::Event::KIND_WARNING,
                  found_once_ ? text : text + "; posed looks for it until it is there");
    return;
  }
  found_once_ = true;
  device_ = std::move(*found);
  writer_ = dynamic_cast<drivers::ColdWriter*>(device_->transport.get());
  upkeep_ = dynamic_cast<drivers::Upkeep*>(device_->transport.get());
  drops_reported_ = 0;
  away_ = false;
  reported_.clear();
  for (const std::string& warning : device_->warnings) {
    ports_.report(v1::Event::KIND_WARNING, warning);
  }
  const std::string link = !device_->transport->only_listens() ? "connected: "
                           : device_->poll.period_ns == 0      ? "listening: "
                                                               : "asking: ";
  use_.restart(source_.counters, ports_.clock());
  source_.present->connected(device_->description);
  source_.slot->give_back.store(false);  // that request was for the previous device
  const bool given = source_.slot->in.push(device_.get());
  assert(given);  // the reader had given back the device before
  ports_.reader->call();
  const std::string note = source_.ports->consume_note();
  ports_.report(v1::Event::KIND_FOUND,
                link + device_->description.identity + (note.empty() ? "" : "; " + note));
}

// Refuses a device that differs from what the stream was set up for: its data would silently be
// taken for other joints.
Result<std::unique_ptr<drivers::Device>> DeviceSupervisor::try_open() {
  auto opened = TRY(driver_.open(source_.config.options, *source_.ports));
  auto device = std::make_unique<drivers::Device>(std::move(opened));
  const drivers::Description& is = device->description;
  const drivers::Description& was = source_.device.description;
  const auto id = [](const drivers::Description& d) { return d.skeleton ? d.skeleton->id : 0; };
  if (id(is) != id(was) || is.samples.names != was.samples.names) {
    return fail("another device answers (" + is.identity +
                "); connect the one that the stream began with, or start posed again");
  }
  if (const auto in_use = source_.present->calibration(); !in_use.toml.empty()) {
    TRY(compile_calibration(is, in_use.toml, in_use.file));
  }
  TRY(device->transport->start(ports_.clock()));
  return device;
}

}  // namespace posed::devices
