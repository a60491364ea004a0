#include "bus/log.h"

#include <ctime>
#include <iterator>
#include <memory>
#include <utility>

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "lcmtypes/printable.h"

namespace forereach {
namespace {

class PrintableMessage final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const std::string text = Printable({message.payload.data(), message.payload.size()});
    out.append(text.data(), text.data() + text.size());
  }
  [[nodiscard]] std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<PrintableMessage>();
  }
};

spdlog::level::level_enum LevelOf(logging::Level level) {
  switch (level) {
    case logging::Level::kInfo: return spdlog::level::info;
    case logging::Level::kWarning: return spdlog::level::warn;
    case logging::Level::kError: break;
  }
  return spdlog::level::err;
}

std::shared_ptr<spdlog::logger> MakeLog(const std::string& name) {
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<PrintableMessage>('*').set_pattern("%H:%M:%S.%e %n %^%l%$: %*");
  auto log = std::make_shared<spdlog::logger>(name, std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
  log->set_formatter(std::move(formatter));
  return log;
}

// Not spdlog's own: that is the user's, in whose program a client is.
std::shared_ptr<spdlog::logger>& Log() {
  static std::shared_ptr<spdlog::logger> log = MakeLog("forereach");
  return log;
}

}  // namespace

void SetUpLog(const std::string& name) { Log() = MakeLog(name); }

namespace logging {

void Silence() { Log()->set_level(spdlog::level::off); }

void Flush() { Log()->flush(); }

void Write(Level level, fmt::string_view format, fmt::format_args values) {
  if (!Log()->should_log(LevelOf(level))) return;
  fmt::memory_buffer line;
  fmt::vformat_to(std::back_inserter(line), format, values);
  Log()->log(LevelOf(level), spdlog::string_view_t(line.data(), line.size()));
}

}  // namespace logging
}  // namespace forereach
