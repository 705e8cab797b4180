"""The brands of robot programs that programs.py evaluates: a module each, with programs of its own
and an interpreter that shares nothing with the product. common.py says what a module offers."""
