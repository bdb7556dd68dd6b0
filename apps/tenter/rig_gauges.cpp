// SPDX-License-Identifier: GPL-3.0-or-later
#include "rig_gauges.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>

#include "interrupt.h"
#include "rig_client.h"

namespace tenter::app {

namespace {

using Json = nlohmann::json;

constexpr auto kPeriod = std::chrono::milliseconds(200);
constexpr int kBar = 20;

struct Options {
  const CLI::Option* socket = nullptr;
  int frames = 0;
};

void declare(CLI::App& command, Options& o) {
  o.socket = command.get_parent()->get_option("--socket");
  command.add_option("--frames", o.frames, "End after so many; 0: at Ctrl-C")
      ->check(CLI::NonNegativeNumber);
}

/// "[#####.....]"; beyond the end with "!".
std::string bar(double share) {
  if (!std::isfinite(share)) return "[" + std::string(kBar, ' ') + "]";
  const int filled = static_cast<int>(std::lround(kBar * std::clamp(share, 0.0, 1.0)));
  return "[" + std::string(filled, '#') + std::string(kBar - filled, '.') +
         (share > 1.0 ? "!" : "]");
}

double numberOf(const Json& value) { return value.is_number() ? value.get<double>() : NAN; }

std::string formatted(const char* format, double value) {
  if (!std::isfinite(value)) return "       -";
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string emergencyText(const Json& status) {
  std::string blind;
  for (const Json& axis : status.value("axes", Json::array())) {
    if (!axis.value("kill_switch", false))
      blind += (blind.empty() ? "" : ", ") + axis.value("name", "");
  }
  const std::string pressed = status.value("emergency_stop", false) ? "PRESSED" : "not pressed";
  return blind.empty() ? pressed : pressed + "; not seen by " + blind;
}

std::string positionText(const Json& axis) {
  const double position_m = numberOf(axis.value("position_m", Json()));
  const Json travel = axis.value("travel_m", Json::array());
  double share = NAN;
  if (travel.size() == 2) {
    const double begin_m = numberOf(travel[0]), end_m = numberOf(travel[1]);
    share = (position_m - begin_m) / (end_m - begin_m);
  }
  return formatted("%8.3f", 1e3 * position_m) + " mm " + bar(share);
}

std::string tensionText(const Json& cell, double working_N) {
  const double gross_N = numberOf(cell.value("gross_N", Json()));
  return formatted("%8.3f", numberOf(cell.value("net_N", Json()))) + " N " +
         bar(std::abs(gross_N) / working_N);
}

Result<int> run(const Options& o, Console& console) {
  const auto client = RigClient::connect(o.socket->as<std::string>());
  if (!client) return client.error();
  const bool in_place = isatty(STDOUT_FILENO) != 0;
  std::size_t drawn = 0;
  for (int i = 0; !interrupted() && (o.frames == 0 || i < o.frames); ++i) {
    if (i > 0) std::this_thread::sleep_for(kPeriod);
    const auto status = (*client)->call("status");
    if (!status) return status.error();
    console.answer = *status;
    if (in_place && drawn > 0) std::printf("\033[%zuA\033[J", drawn);
    const std::vector<std::string> lines = gaugeLines(*status);
    for (const std::string& line : lines) console.say(line);
    std::fflush(stdout);
    drawn = lines.size();
  }
  return kDone;
}

}  // namespace

std::vector<std::string> gaugeLines(const Json& status) {
  const std::string reason = status.value("reason", "");
  std::vector<std::string> lines{status.value("rig", "") + ": " + status.value("state", "") +
                                     (reason.empty() ? "" : " (" + reason + ")"),
                                 "emergency stop: " + emergencyText(status)};
  const double working_N =
      numberOf(status.value("limits", Json::object()).value("working_N", Json()));
  Json cells = status.value("cells", Json::array());
  for (const Json& axis : status.value("axes", Json::array())) {
    std::string line = "  " + axis.value("name", "") + " " + positionText(axis);
    const auto cell = std::find_if(cells.begin(), cells.end(), [&](const Json& c) {
      return c.value("name", Json()) == axis.value("cell", Json());
    });
    std::string faults = axis.value("fault", "");
    if (!axis.value("homed", true)) faults += faults.empty() ? "not homed" : ", not homed";
    if (cell != cells.end()) {
      line += "  " + cell->value("name", "") + " " + tensionText(*cell, working_N);
      const std::string fault = cell->value("fault", "");
      if (!fault.empty()) faults += (faults.empty() ? "" : ", ") + fault;
      cells.erase(cell);
    }
    lines.push_back(line + (faults.empty() ? "" : "  " + faults));
  }
  for (const Json& cell : cells)
    lines.push_back("  " + cell.value("name", "") + " " + tensionText(cell, working_N) + "  " +
                    cell.value("fault", ""));
  for (const Json& camera : status.value("cameras", Json::array()))
    lines.push_back("  " + camera.value("name", "") + "  " + camera.value("serial", "") + "  " +
                    counted(camera.value("completed", std::size_t{0}), "frame") + "  " +
                    camera.value("fault", ""));
  return lines;
}

Verb rigGauges() {
  return {"gauges", "Positions and tensions, live",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, run); }};
}

}  // namespace tenter::app
