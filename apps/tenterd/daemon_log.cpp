// SPDX-License-Identifier: GPL-3.0-or-later
#include "daemon_log.h"

#include <spdlog/async.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <array>
#include <chrono>

#include "tenter/session/session_header.h"

namespace tenter::daemon {
namespace {

constexpr std::size_t kLongestQueue = 8192;
constexpr std::array<spdlog::level::level_enum, 3> kLevels{spdlog::level::info, spdlog::level::warn,
                                                           spdlog::level::err};
constexpr std::array<std::string_view, 3> kLevelNames{"info", "warning", "error"};

}  // namespace

void startLog() {
  spdlog::init_thread_pool(kLongestQueue, 1);
  auto logger = std::make_shared<spdlog::async_logger>(
      "tenterd", std::make_shared<spdlog::sinks::stderr_sink_mt>(), spdlog::thread_pool(),
      spdlog::async_overflow_policy::overrun_oldest);
  spdlog::set_default_logger(logger);
  spdlog::set_pattern("%v");
  spdlog::flush_on(spdlog::level::info);
}

void endLog() { spdlog::shutdown(); }

void logEvent(LogLevel level, std::string_view event, nlohmann::json fields) {
  const auto place = static_cast<std::size_t>(level);
  nlohmann::ordered_json line{{"time", utcStamp(std::chrono::system_clock::now())},
                              {"level", kLevelNames[place]},
                              {"event", event}};
  for (const auto& [key, value] : fields.items()) line[key] = value;
  spdlog::log(kLevels[place], "{}",
              line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

}  // namespace tenter::daemon
