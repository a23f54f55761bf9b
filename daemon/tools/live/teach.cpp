#include "daemon/tools/live/teach.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>

#include <unistd.h>

#include <spdlog/fmt/fmt.h>

#include "daemon/config/config.hpp"
#include "daemon/tools/command/client.hpp"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

constexpr int kGetReady_s = 3;  // between the announcement of a walk and its beginning
constexpr std::chrono::milliseconds kLookAgain{100};
constexpr std::size_t kMaxSoFar = 60;  // bytes of a verdict on the line of a countdown
constexpr int kMaxRefused = 4;         // shows of a sign

class Lesson {
 public:
  Lesson(const TeachOptions& options, const Ask& ask) : options_(options), ask_(ask) {}

  // What cannot be is told before somebody has walked.
  Result<> check() {
    if (!config::is_stream_name(options_.name)) {
      return fail(in_quotes(options_.name) + " cannot be the name of " +
                  (options_.signs.empty() ? "a style" : "signs") +
                  "; it has a-z, digits, '-' and '_', 1 to 32");
    }
    const auto reply = TRY(ask_(about_stream()));
    const v1::Teaching& now = reply.teaching();
    const bool kept = now.neutral_walk().takes() + now.style_walk().takes() + now.sign_size() > 0;
    if (!kept || now.step() == v1::Teaching::STEP_IN_USE) return {};
    if (options_.anew) {
      v1::ControlRequest request;
      request.mutable_teach()->set_stream(now.stream());
      request.mutable_teach()->mutable_forget();
      TRY(ask_(request));
      return {};
    }
    if (now.stream() != options_.stream) {
      return fail(
          fmt::format("a lesson of stream {} is not finished, perhaps on somebody's page; "
                      "finish it there, or --anew forgets it",
                      clean_name(now.stream())));
    }
    const bool replaces = options_.signs.empty() && !options_.more &&
                          ((options_.neutral_s > 0.0 && now.neutral_walk().takes() > 0) ||
                           (options_.style_s > 0.0 && now.style_walk().takes() > 0));
    if (!replaces) return {};
    return fail(
        fmt::format("a lesson of stream {} is not finished, perhaps on somebody's page, and "
                    "has {} walks as usual, {} in the style and {} signs; --more adds to "
                    "its walks, --neutral 0 or --style 0 keeps one kind, --anew forgets all",
                    clean_name(now.stream()), now.neutral_walk().takes(), now.style_walk().takes(),
                    now.sign_size()));
  }

  Result<> walk(bool style, double walk_s) {
    const std::string how = style ? fmt::format("walk in the style ({})", clean_name(options_.name))
                                  : "walk as you are";
    v1::ControlRequest request = about_stream();
    auto& mark = *request.mutable_teach()->mutable_mark();
    mark.set_style(style);
    mark.set_seconds(walk_s);
    mark.set_more(options_.more);
    const auto now = TRY(marked(how, request));
    const v1::TaughtWalk& walked = style ? now.style_walk() : now.neutral_walk();
    if (!walked.good()) {
      return fail(fmt::format("{}: {}{}", how, why_not(walked), again(style)));
    }
    say(fmt::format("{}: {}", how, clean(walked.sentence())));
    return {};
  }

  // Until the sign was shown well often enough; nobody shows one that is refused again and again.
  Result<> show(const std::string& label) {
    int refused = 0;
    for (int shown = 0; shown < options_.shows;) {
      const std::string how = fmt::format("show {} ({} of {}): rest, the sign, held, rest",
                                          clean_name(label), shown + 1, options_.shows);
      v1::ControlRequest request = about_stream();
      request.mutable_teach()->mutable_show()->set_label(label);
      request.mutable_teach()->mutable_show()->set_seconds(options_.show_s);
      const auto now = TRY(marked(how, request));
      if (now.show().good()) {
        ++shown;
        say(clean(now.show().sentence()));
      } else if (++refused > kMaxRefused) {
        return fail(fmt::format("show {}: {}", clean_name(label), why_not(now.show())));
      } else {
        say(fmt::format("once more: {}", why_not(now.show())));
      }
    }
    return {};
  }

  Result<v1::ControlReply> train() {
    v1::ControlRequest request = about_stream();
    request.mutable_teach()->mutable_train()->set_name(options_.name);
    request.mutable_teach()->mutable_train()->set_signs(!options_.signs.empty());
    TRY(ask_(request));
    begun_ = true;
    auto reply = TRY(await([&](const v1::Teaching& now) {
      count_down("learning ...");
      return now.step() == v1::Teaching::STEP_TRAINING || now.step() == v1::Teaching::STEP_STARTING;
    }));
    const v1::Teaching& now = reply.teaching();
    if (now.step() != v1::Teaching::STEP_IN_USE) {
      return fail(
          std::string(options_.signs.empty() ? "the style was" : "the signs were") +
          " not learnt: " + (now.problem().empty() ? "it was cancelled" : clean(now.problem())));
    }
    say(clean(now.verdict()));
    if (now.sequence() == 0) {
      say(fmt::format("{}: {} is in effect when it comes", options_.stream, clean(now.model())));
    } else {
      say(fmt::format("{}: {} is in effect from frame {}, {:.1f} s later", options_.stream,
                      clean(now.model()), now.sequence(), now.train_s()));
    }
    return reply;
  }

  // Whether the daemon was asked for a walk or a training: only that is ours to cancel.
  [[nodiscard]] bool begun() const { return begun_; }

 private:
  [[nodiscard]] v1::ControlRequest about_stream() const {
    v1::ControlRequest request;
    request.mutable_teach()->set_stream(options_.stream);
    return request;
  }

  // Counts down, asks for a walk or a show and waits for its end.
  Result<v1::Teaching> marked(const std::string& how, const v1::ControlRequest& request) {
    for (int left = kGetReady_s; left > 0; --left) {
      count_down(fmt::format("{} in {}", how, left));
      TRY(pause(std::chrono::seconds(1)));
    }
    TRY(ask_(request));
    begun_ = true;
    const auto reply = TRY(await([&](const v1::Teaching& now) {
      const std::string& so_far = (now.style() ? now.style_walk() : now.neutral_walk()).sentence();
      count_down(fmt::format("{} ... {:.0f} s  {}", how, std::ceil(now.seconds_left()),
                             request.teach().has_mark() ? clean(so_far, kMaxSoFar) : ""));
      return now.step() == v1::Teaching::STEP_MARKING || now.step() == v1::Teaching::STEP_CHECKING;
    }));
    return reply.teaching();
  }

  // It may have been cancelled by another client.
  static std::string why_not(const v1::TaughtWalk& marked) {
    return marked.sentence().empty() ? "it was cancelled" : clean(marked.sentence());
  }

  // Asks how it stands while `goes_on` says so.
  template <typename GoesOn>
  Result<v1::ControlReply> await(GoesOn&& goes_on) {
    while (true) {
      auto reply = TRY(ask_(about_stream()));
      if (reply.teaching().stream() != options_.stream) {  // somebody began anew
        return fail("another stream is taught now; begin again when that is over");
      }
      if (!goes_on(reply.teaching())) return reply;
      TRY(pause(kLookAgain));
    }
  }

  static Result<> pause(std::chrono::milliseconds time) {
    const auto end = std::chrono::steady_clock::now() + time;
    while (std::chrono::steady_clock::now() < end) {
      if (Interrupt::came()) return fail("interrupted");
      std::this_thread::sleep_for(std::min(time, kLookAgain));
    }
    return {};
  }

  // How to do it once more without the walk that is good already.
  [[nodiscard]] std::string again(bool style) const {
    return style ? "; the walk as usual is kept: once more with --neutral 0" : "; once more";
  }

  // On the line that is replaced by the next one; a log or a pipe gets none of them.
  void count_down(const std::string& text) const {
    if (options_.quiet || isatty(STDOUT_FILENO) == 0) return;
    std::printf("\r\x1b[K%s", text.c_str());
    std::fflush(stdout);
  }
  void say(const std::string& text) const {
    if (options_.quiet) return;
    count_down("");
    std::puts(text.c_str());
    std::fflush(stdout);
  }

  const TeachOptions& options_;
  const Ask& ask_;
  bool begun_ = false;
};

}  // namespace

Result<v1::ControlReply> teach(const TeachOptions& options, const Ask& ask) {
  Lesson lesson(options, ask);
  const auto all = [&]() -> Result<v1::ControlReply> {
    TRY(lesson.check());
    for (const std::string& sign : options.signs) {
      TRY(lesson.show(sign));
    }
    if (!options.signs.empty()) return lesson.train();
    if (options.neutral_s > 0.0) {
      TRY(lesson.walk(false, options.neutral_s));
    }
    if (options.style_s > 0.0) {
      TRY(lesson.walk(true, options.style_s));
    }
    return lesson.train();
  };
  auto taught = all();
  if (!taught && lesson.begun() && Interrupt::came()) {
    v1::ControlRequest request;
    request.mutable_teach()->set_stream(options.stream);
    request.mutable_teach()->mutable_cancel();
    static_cast<void>(ask(request));  // does not wait for the answer
    std::this_thread::sleep_for(kLookAgain);
  }
  return taught;
}

}  // namespace posed::tools
