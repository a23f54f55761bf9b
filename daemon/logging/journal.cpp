#include "daemon/logging/journal.hpp"

#include <sys/stat.h>
#include <sys/uio.h>
#include <syslog.h>

#include <cstdlib>

#include <spdlog/common.h>
// Otherwise the header adds this file's name and line to each message.
#define SD_JOURNAL_SUPPRESS_LOCATION
#include <systemd/sd-journal.h>

namespace posed::logging {
namespace {

int priority_of(int level) {
  switch (level) {
    case spdlog::level::critical:
      return LOG_CRIT;
    case spdlog::level::err:
      return LOG_ERR;
    case spdlog::level::warn:
      return LOG_WARNING;
    case spdlog::level::info:
      return LOG_INFO;
    default:
      return LOG_DEBUG;
  }
}

}  // namespace

bool is_journal(int descriptor) {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat info{};
  if (stream == nullptr || ::fstat(descriptor, &info) != 0) return false;
  return stream == std::to_string(info.st_dev) + ':' + std::to_string(info.st_ino);
}

std::vector<std::string> journal_fields(int level, std::string_view text, std::string_view cause,
                                        std::uint64_t count) {
  std::vector<std::string> fields{"MESSAGE=" + std::string(text),
                                  "PRIORITY=" + std::to_string(priority_of(level)),
                                  "SYSLOG_IDENTIFIER=posed", "POSED_CAUSE=" + std::string(cause),
                                  "POSED_COUNT=" + std::to_string(count)};
  const std::size_t end = text.find_first_of(" :");
  if (end != std::string_view::npos && end > 0 && text.substr(end).starts_with(": ")) {
    fields.push_back("POSED_STREAM=" + std::string(text.substr(0, end)));
  }
  return fields;
}

bool send_to_journal(const std::vector<std::string>& fields) {
  std::vector<iovec> parts;
  for (const std::string& field : fields) {
    // The system only reads them.
    parts.push_back({.iov_base = const_cast<char*>(field.data()),  // NOLINT
                     .iov_len = field.size()});
  }
  return ::sd_journal_sendv(parts.data(), static_cast<int>(parts.size())) >= 0;
}

}  // namespace posed::logging
