# SPDX-License-Identifier: GPL-3.0-or-later
# How everything here is compiled. Release is -O3 -DNDEBUG for any x86-64; results then do not depend on the
# machine that compiled (no fused multiply-add, no -ffast-math).
add_compile_options(-fno-math-errno)  # std::sqrt becomes one instruction; nobody here reads errno after it
if(TENTER_NATIVE)
  add_compile_options(-march=native)
endif()

add_library(tenter_warnings INTERFACE)
target_compile_options(tenter_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion
                                                 -Wno-sign-conversion
                                                 # GCC 12 misreads "text" + std::string (bug 105651).
                                                 -Wno-restrict)
if(NOT TENTER_SANITIZE)  # the extra code of sanitizers makes GCC 12 warn of what is not there
  target_compile_options(tenter_warnings INTERFACE -Werror)
endif()
