// What posed says when nothing else can.
#pragma once

namespace posed::system {

// From now on an exception that nobody catches, on whatever thread, ends the process with one
// sentence on stderr and exit code 1: too few threads, too little memory, or a fault of posed. Such
// exceptions come from code that starts threads and allocates anywhere; at none of these places
// could more be done. Cold.
void end_with_a_sentence();

}  // namespace posed::system
