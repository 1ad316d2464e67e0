"""What is told beside a name: where, how sure, what else, what could not be seen, and what to measure next."""
