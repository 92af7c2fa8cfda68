/// Only in sanitized builds. urdfdom's links and joints hold each other, so a URDF with a circle, which it
/// refuses, is never freed: not ours to mend.
extern "C" const char* __lsan_default_suppressions() { return "leak:urdf::parseURDF\n"; }
