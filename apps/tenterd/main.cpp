// SPDX-License-Identifier: GPL-3.0-or-later
// tenterd: drives one rig and serves it on a Unix socket.
#include <sys/prctl.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>

#include "daemon_log.h"
#include "socket_server.h"

namespace tenter::daemon {
namespace {

constexpr int kTicksPerWatchdog = 10;

volatile std::sig_atomic_t g_quit = 0;
extern "C" void onSignal(int /*signal*/) { g_quit = 1; }

int fail(const Error& error) {
  std::fprintf(stderr, "tenterd: %s\n", error.message().c_str());
  return static_cast<int>(error.kind);
}

int serve(const std::string& config_file, const std::string& socket, const std::string& group) {
  auto config = readRigConfig(config_file);
  if (!config) return fail(config.error());
  auto service = RigService::start(*std::move(config));
  if (!service) return fail(service.error());
  Rpc rpc(**service);
  auto server = SocketServer::listen(socket, group, rpc);
  if (!server) return fail(server.error());
  logEvent(LogLevel::kInfo, "serving", {{"rig", (*service)->config().name}, {"socket", socket}});
  sd_notify(0, "READY=1");
  int ticks = 0;
  (*service)->loop([&] {
    rpc.tick();
    if (++ticks % kTicksPerWatchdog == 0) sd_notify(0, "WATCHDOG=1");
    if (g_quit != 0) (*service)->quit();
  });
  sd_notify(0, "STOPPING=1");
  logEvent(LogLevel::kInfo, "ended", nlohmann::json::object());
  return 0;
}

int run(int argc, char** argv) {
  CLI::App app{"Drives a rig and serves it on a Unix socket", "tenterd"};
  std::string config, socket, group;
  bool with_parent = false;
  app.add_option("--config", config, "The rig's configuration (docs/formats/rig.md)")->required();
  app.add_option("--socket", socket, "Unix socket to make; its clients are `tenter rig`")
      ->required();
  app.add_option("--group", group, "Group whose members may connect");
  app.add_flag("--end-with-parent", with_parent,
               "Unload and end when the program that started this one does; Ctrl-C is its own");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(ErrorKind::kUsage);
  }
  startLog();
  struct sigaction action {};
  action.sa_handler = onSignal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGHUP, &action, nullptr);  // its terminal is gone
  std::signal(SIGPIPE, SIG_IGN);        // whoever read its log is
  if (with_parent) {
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGTERM);
  }
  // A file that may not grow is a disk that is full: the write says so, and the rig unloads.
  std::signal(SIGXFSZ, SIG_IGN);
  const int code = serve(config, socket, group);
  endLog();
  return code;
}

}  // namespace
}  // namespace tenter::daemon

int main(int argc, char** argv) {
  try {
    return tenter::daemon::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tenterd: internal error: %s\n", error.what());
    return 1;
  }
}
