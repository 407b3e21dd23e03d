"""The modules of fem, written anew; nothing outside imports them until they take the place of the old ones."""
