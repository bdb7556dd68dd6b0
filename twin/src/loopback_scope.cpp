// SPDX-License-Identifier: GPL-3.0-or-later
#include "loopback_scope.h"

#include <arpa/inet.h>
#include <dlfcn.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <array>

namespace tenter {
namespace {

struct Interface {
  std::array<char, 3> name{'l', 'o', '\0'};
  sockaddr_in address{}, mask{};
  ifaddrs entry{};
};
thread_local Interface t_interface;
thread_local bool t_in_scope = false;

template <class Function>
Function* realFunction(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

LoopbackScope::LoopbackScope(const std::string& address) {
  Interface& out = t_interface;
  out.address.sin_family = out.mask.sin_family = AF_INET;
  inet_pton(AF_INET, address.c_str(), &out.address.sin_addr);
  inet_pton(AF_INET, "255.0.0.0", &out.mask.sin_addr);
  out.entry = {};
  out.entry.ifa_name = out.name.data();
  out.entry.ifa_flags = IFF_UP | IFF_LOOPBACK | IFF_RUNNING;
  out.entry.ifa_addr = reinterpret_cast<sockaddr*>(&out.address);
  out.entry.ifa_netmask = reinterpret_cast<sockaddr*>(&out.mask);
  out.entry.ifa_broadaddr = reinterpret_cast<sockaddr*>(&out.address);
  t_in_scope = true;
}

LoopbackScope::~LoopbackScope() { t_in_scope = false; }

}  // namespace tenter

// In place of the C library's, for this program and the libraries it uses.
extern "C" int getifaddrs(ifaddrs** list) noexcept {
  using namespace tenter;
  if (!t_in_scope) return realFunction<int(ifaddrs**)>("getifaddrs")(list);
  *list = &t_interface.entry;
  return 0;
}

extern "C" void freeifaddrs(ifaddrs* list) noexcept {
  using namespace tenter;
  if (list != &t_interface.entry) realFunction<void(ifaddrs*)>("freeifaddrs")(list);
}
