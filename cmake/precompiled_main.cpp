// Only the precompiled header of this file is used.
int main() {}
