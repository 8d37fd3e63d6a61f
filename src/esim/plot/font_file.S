/* The bytes of the font file ESIM_FONT, from esim_font_begin to esim_font_end. */
        .section .rodata
        .global esim_font_begin
        .global esim_font_end
        .balign 16
esim_font_begin:
        .incbin ESIM_FONT
esim_font_end:
        .section .note.GNU-stack,"",%progbits
