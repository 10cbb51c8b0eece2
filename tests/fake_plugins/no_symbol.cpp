// A shared library that has nothing to do with crt but its file name.
int somethingElse() { return 0; }
