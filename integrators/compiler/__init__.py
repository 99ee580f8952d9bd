"""From symbolic rows to machine code, or to functions of numbers of any precision."""
