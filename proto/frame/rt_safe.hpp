// RT_SAFE marks a function that keeps the real-time contract: it does not allocate, lock, log,
// throw or call the system. It stands before the declaration. The tidy test searches the bodies of
// marked functions for what breaks the contract, and clang keeps the mark in its syntax tree.
#pragma once

#ifdef __clang__
#define RT_SAFE [[clang::annotate("rt-safe")]]
#else
#define RT_SAFE
#endif
