#include "bus/log.h"

#include <ctime>
#include <iterator>
#include <memory>

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

}  // namespace

void SetUpLog(const std::string& name) {
  spdlog::set_default_logger(spdlog::stderr_color_mt(name));
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<PrintableMessage>('*').set_pattern("%H:%M:%S.%e %n %^%l%$: %*");
  spdlog::set_formatter(std::move(formatter));
}

namespace logging {

void Silence() { spdlog::set_level(spdlog::level::off); }

void Flush() { spdlog::default_logger()->flush(); }

void Write(Level level, fmt::string_view format, fmt::format_args values) {
  if (!spdlog::should_log(LevelOf(level))) return;
  fmt::memory_buffer line;
  fmt::vformat_to(std::back_inserter(line), format, values);
  spdlog::log(LevelOf(level), spdlog::string_view_t(line.data(), line.size()));
}

}  // namespace logging
}  // namespace forereach
