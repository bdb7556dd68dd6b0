# SPDX-License-Identifier: GPL-3.0-or-later
# -DTENTER_SANITIZE=address,undefined (or thread) instruments everything that this project compiles. Little optimisation
# and only line tables: instrumented code is compiled often and run briefly. Assertions (Eigen's too) stay in.
set(TENTER_SANITIZE "" CACHE STRING "Sanitizers to compile with, as -fsanitize takes them")
if(TENTER_SANITIZE)
  add_compile_options(-fsanitize=${TENTER_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all -O1 -g1 -UNDEBUG)
  add_link_options(-fsanitize=${TENTER_SANITIZE})
endif()
