#include "daemon/tools/logs/convert_mcap.hpp"

#include <cstdio>

#include <nlohmann/json.hpp>

#include "daemon/tools/command/client.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/waiting.hpp"
#include "daemon/tools/export/log_mcap.hpp"
#include "proto/text/json_text.hpp"

namespace posed::tools {

int convert_to_mcap(const std::string& log, const std::string& out, bool json) {
  const auto summary = [&] {
    // A file is written with signals blocked, so the thread that shows the wait receives Ctrl-C.
    const Waiting waiting("writing " + out);
    const Interrupt interrupt;
    return replay::write_mcap(log, out, Interrupt::came);
  }();
  if (!summary) return report(summary.error());
  for (const std::string& warning : summary->warnings) {
    std::fprintf(stderr, "posed: %s: %s\n", log.c_str(), warning.c_str());
  }
  if (!json) {
    std::fprintf(stderr, "posed: wrote %s: %llu messages in %zu topics\n", out.c_str(),
                 static_cast<unsigned long long>(summary->messages), summary->topics);
    return static_cast<int>(ExitCode::kDone);
  }
  const nlohmann::json line{{"in", log},
                            {"out", out},
                            {"messages", summary->messages},
                            {"topics", summary->topics},
                            {"warnings", summary->warnings}};
  std::printf("%s\n", json_text(line).c_str());
  return static_cast<int>(ExitCode::kDone);
}

}  // namespace posed::tools
