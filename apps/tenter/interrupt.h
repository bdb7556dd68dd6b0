// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace tenter::app {

/// From here on the first Ctrl-C (SIGINT) or SIGTERM only asks to stop; the second ends the
/// program.
void catchInterrupts();

/// For a verb that writes nothing and has nothing to keep: the first one ends the program again.
void stopCatchingInterrupts();

/// Whether somebody asked to stop. Solvers poll it and keep the best so far.
bool interrupted();

}  // namespace tenter::app
