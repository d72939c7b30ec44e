// The commands of scree-view; each has a file of its own.
#pragma once

namespace scree {

int run_view(int argc, char** argv);     ///< the window
int run_shot(int argc, char** argv);     ///< one picture
int run_fly(int argc, char** argv);      ///< a measured flight
int run_audit(int argc, char** argv);    ///< the promise against the truth
int run_compare(int argc, char** argv);  ///< what accuracy costs, method by method

}  // namespace scree
