/** FOREREACH_SANITIZED: 1 if an address or thread sanitizer is compiled in, otherwise 0. g++ and clang say it
 * differently. */
#pragma once

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define FOREREACH_SANITIZED 1
#endif
#endif
#if !defined(FOREREACH_SANITIZED) && (defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__))
#define FOREREACH_SANITIZED 1
#endif
#ifndef FOREREACH_SANITIZED
#define FOREREACH_SANITIZED 0
#endif
